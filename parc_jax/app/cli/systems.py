"""`parc-jax systems`, and finding a system by name; `parc-jax doctor`."""

import contextlib
import importlib
import inspect
import io
import os
import sys
from pathlib import Path
from types import ModuleType
from typing import Annotated

from parc_jax.app.cli.options import Offer
from parc_jax.common.errors import InputError
from parc_jax.learning.systems.user_code import blamed, own_place, said

REQUIRED = {
    "system": ("name", "domain", "time", "n_p", "n_q"),
    "problem": ("goal", "obstacles", "body", "start"),
}  # attributes of the results of a module's functions

PACKAGES = "jax jaxlib flax optax mujoco mujoco-mjx brax scipy clarabel numpy"

BODY = Offer("learning.learn.Learning", left_out="its study's, or ", only=("body",))


def systems(name: str | None = None, /, *, study: Annotated[dict, BODY]) -> int:
    """List the systems that `run` and `learn` know, or print the scene of one. Example: parc-jax
    systems drift_parking

    Args:
        name: Print this system's scene as a TOML file for `solve`, to be changed.
    """
    if name is None:
        for each in installed():
            print(f"{each:16} {(find(each, or_job=True).__doc__ or '').splitlines()[0]}")
        return 0
    from parc_jax.learning.labels import labels_of
    from parc_jax.learning.system import points_of
    from parc_jax.problem.problem_file import problem_text

    module = find(name)
    body = study_of(module, **study).body
    black_box = black_box_of(module, None, body)
    scene = build(module, "problem", body=body)
    print(problem_text(scene, labels_of(black_box), points_of(black_box)), end="")
    return 0


def installed() -> tuple[str, ...]:
    """Names of the systems and jobs that come with the package and are installed."""
    sims = importlib.import_module("sims")
    names = sims.NAMES + sims.JOBS
    return tuple(name for name in names if importlib.util.find_spec(sims.place(name)))


def find(name: str, needed: tuple[str, ...] = ("system", "problem"), or_job=False) -> ModuleType:
    """The module of a system: an installed one, or any importable module with the `needed`
    functions, or, with or_job, a function `job`. Raises InputError.
    """
    target = importlib.import_module("sims").place(name) if name in installed() else name
    if target == name and os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())  # a console script does not look where it is started
    try:
        module = importlib.import_module(target)
    except Exception as error:  # any error of the user's module
        names = (target, target.split(".")[0])  # the last one is empty of a path, as ./robot
        if not names[1] or (isinstance(error, ModuleNotFoundError) and error.name in names):
            raise InputError(
                f"system: expected one of {', '.join(installed())}, or a module of your own, as "
                f"folder.file without .py; got {name!r} ({error})."
            ) from None
        place = f" in {where}" if (where := own_place(error)) else ""
        raise InputError(
            f"system {name!r}: expected a module that can be imported; it fails{place}: "
            f"{said(error)}."
        ) from None
    for function in () if or_job and hasattr(module, "job") else needed:
        if not callable(getattr(module, function, None)):
            raise InputError(
                f"system {name!r}: expected a function `{function}()` in module {target}; there is "
                "none."
            )
    return module


def study_of(module: ModuleType, **changes):
    """The `Study` of a system, or the default, but for the given fields. Raises InputError."""
    from parc_jax.app.study.settings import Study

    return getattr(module, "STUDY", Study()).replace(**changes)


def black_box_of(module: ModuleType, plant: str | None, body: str | None):
    """module.system() with the plant, and the body where it depends on it. Raises InputError."""
    depends = "body" in inspect.signature(module.system).parameters
    return build(module, "system", plant=plant, body=body if depends else None)


def black_box_with(module: ModuleType, points: tuple[str, ...]):
    """module.system() of whichever of its BODIES has these reference points. Raises InputError."""
    from parc_jax.learning.system import points_of

    black_box = build(module, "system")
    for body in (None, *getattr(module, "BODIES", ())):
        black_box = black_box if body is None else black_box_of(module, None, body)
        if points_of(black_box) == points:
            return black_box
    raise InputError(
        f"system {module.__name__}: expected the reference points {', '.join(points)}; it has "
        f"{', '.join(points_of(black_box))}."
    )


def asked_of(path: Path, scene: Path | None):
    """The model of a file, or the one that comes along with the system of that name. And the
    problem of a scene file, or of the model's system. Raises InputError.
    """
    from parc_jax.learning.model import load
    from parc_jax.problem.problem import require_dimensions
    from parc_jax.problem.problem_file import load_problem

    sims = importlib.import_module("sims")
    along = str(path) in sims.NAMES and not path.is_file()
    model = load(sims.model_file(str(path)) if along else path)
    if scene is None:
        return model, scene_of(model)
    problem = load_problem(scene, model.points)
    require_dimensions(problem, model)  # before its labels are the model's
    return model.with_labels(dict(problem.labels)), problem


def scene_of(model):
    """The scene of the system that a model is of, with the body of its study, or the first of its
    BODIES that has the model's reference points. Raises InputError.
    """
    from parc_jax.safe_set.verdict.outline import require_fit

    if model.system not in installed():
        raise InputError(
            f"scene: expected a .toml file, since nothing is known of a scene of "
            f"{model.system or 'unnamed'!r}; got none. Name it after the model."
        )
    module = find(model.system)
    refused = None
    for body in dict.fromkeys((study_of(module).body, *getattr(module, "BODIES", ()))):
        problem = build(module, "problem", body=body)
        try:
            require_fit(problem, model)
            return problem
        except InputError as error:
            refused = refused or error
    raise InputError(f"{refused} Name a scene of your own.")


def build(module: ModuleType, function: str, **options):
    """Call module.system or module.problem, which print nothing, or module.job, with the options
    that were given. Raises InputError for unknown ones.
    """
    chosen = {key: value for key, value in options.items() if value is not None}
    target = getattr(module, function)
    takes = inspect.signature(target).parameters
    name = f"{module.__name__}.{function}"
    for key in chosen:
        if key not in takes:
            raise InputError(f"{key}: expected an option of {name} ({', '.join(takes) or 'none'}).")
    quiet = function in REQUIRED  # simulators print on import
    silence = contextlib.redirect_stdout(io.StringIO()) if quiet else contextlib.nullcontext()
    with blamed(f"{name}(): expected it to run"), silence:
        built = target(**chosen)
    needed = REQUIRED.get(function, ())
    lacking = [one for one in needed if not hasattr(built, one)]
    if lacking:
        raise InputError(
            f"{name}(): expected something with {', '.join(needed)}; got {type(built).__name__} "
            f"without {lacking[0]}."
        )
    return built


def doctor() -> int:
    """Check versions and arithmetic of this installation. Example: parc-jax doctor"""
    from importlib import metadata

    from parc_jax.common.backend import COMPILER, backend
    from parc_jax.common.probes import probe_all, probe_options

    for name in PACKAGES.split():
        try:
            print(f"  {name:12} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            print(f"  {name:12} missing: pip install {name}")
    findings = [*probe_all(), probe_options(dict(backend().compiler) | (COMPILER or {}))]
    for finding in findings:
        print(f"  {'ok  ' if finding.ok else 'FAIL'} {finding.name}: {finding.detail}")
    fit = all(finding.ok for finding in findings)
    print("Fit to certify." if fit else "Not fit to certify: see the lines marked FAIL.")
    return 0 if fit else 1
