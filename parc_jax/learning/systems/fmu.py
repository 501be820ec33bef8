"""Models that other tools exported, as FMUs (FMI 2 and 3, co-simulation), as black boxes."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path

from parc_jax.common.errors import InputError
from parc_jax.common.on_use import package
from parc_jax.common.sets.box import Box
from parc_jax.learning.system import ONE_POINT, TimeGrid, check_points
from parc_jax.learning.systems.fmu_run import FmuRun, digest_of
from parc_jax.learning.systems.python_system import PythonSystem, python_system
from parc_jax.learning.systems.user_code import said

VERSIONS = ("2.0", "3.0")
REAL = ("Real", "Float64", "Float32")
WHOLE = ("Integer", "Int64", "Int32", "UInt64", "UInt32")
SETTABLE = ("parameter", "structuralParameter", "input")


def fmu_system(
    path,
    parameters: Sequence[str],
    outputs: Sequence[str],
    domain: Box,
    time: TimeGrid,
    *,
    q: Sequence[str] = (),
    points: Sequence[str] = ONE_POINT,
    seed: str | None = None,
    start: Mapping[str, object] | None = None,
    step: float | None = None,
    name: str | None = None,
    workers: int | None = None,
    executor: Executor | Callable[[], Executor] | None = None,
    lost: str = "failed",
    law: Mapping | None = None,
) -> PythonSystem:
    """A black box around an FMU for co-simulation (FMI 2 or 3). Needs the extra `fmu`.

    path: the file; workers on other machines need it at the same path.
    parameters (n_k,): variables that k sets before a run, in order; inputs stay constant.
    outputs: variables that are the coordinates of p [m], of several reference points point by
        point; relative to the first one's start. q: variables that are other goal states, at t_f.
    points: names of the reference points. seed: a variable for a whole number that decides all that
        is random in the model; without one nothing may be.
    start: further variables with their values. step: communication step [s], a whole part of the
        time between records, which it is by default.
    name: of the system, by default that of the model. workers, executor, lost, law: as of
        `python_system`; the law includes the file's hash. A run that the FMU ends early or discards
        has failed.
    Raises InputError.
    """
    path = Path(path).absolute()
    described = _described(path)
    names = check_points(str(path), points)
    known = {variable.name: variable for variable in described.modelVariables}
    settable = [
        variable.name
        for variable in described.modelVariables
        if variable.causality in SETTABLE and variable.variability != "constant"
    ]
    fixed = tuple((start or {}).items())
    _require(path, "parameters", parameters, known, settable, REAL)
    _require(path, "start", [word for word, _ in fixed], known, settable, ())
    _require(path, "seed", [] if seed is None else [seed], known, settable, WHOLE)
    _require(path, "outputs", outputs, known, list(known), REAL)
    _require(path, "q", q, known, list(known), REAL)
    given = [*parameters, *dict(fixed), *([] if seed is None else [seed])]
    n_p, beyond = divmod(len(outputs), len(names))
    if len(parameters) != domain.n or beyond or n_p < 1 or len({*given}) < len(given):
        raise InputError(
            f"{path}: expected a parameter for each of {domain.n} axes of the domain, outputs for "
            f"{len(names)} reference points, equally many each, and nothing set twice; got "
            f"{len(parameters)} parameters and {len(outputs)} outputs."
        )
    substeps = 1 if step is None else round(time.dt_record / step) if step > 0 else 0
    if substeps < 1 or (step is not None and abs(substeps * step - time.dt_record) > 1e-9 * step):
        raise InputError(
            f"{path}: expected a step that is a whole part of dt_record = {time.dt_record:g} s; "
            f"got {step}."
        )
    digest = digest_of(path)
    variables = tuple(parameters), tuple(outputs), tuple(q), fixed, seed
    grid = time.t_f, time.dt_record, substeps
    run = FmuRun(str(path), digest, *variables, *grid, len(names))
    return python_system(
        run,
        domain,
        time,
        name=name or described.modelName,
        n_p=n_p,
        n_q=len(q),
        workers=workers,
        executor=executor,
        lost=lost,
        law={"fmu": digest[:16]} | dict(start or {}) | dict(law or {}),
        points=names,
        k_labels=[_label(known[word]) for word in parameters],
        q_labels=[_label(known[word]) for word in q],
    )


def _described(path: Path):
    """Model description of an FMU. Raises InputError where it cannot be run here."""
    fmpy = package("fmpy", str(path), "fmu")
    if not path.is_file():
        raise InputError(f"{path}: no such file.")
    try:
        described = fmpy.read_model_description(str(path), validate=False)
        there = fmpy.supported_platforms(str(path))
    except Exception as error:  # zip, XML, and what fmpy makes of them
        raise InputError(
            f"{path}: expected an FMU, a zip file with a modelDescription.xml; {said(error)}. "
            "Export it again."
        ) from None
    if described.fmiVersion not in VERSIONS or described.coSimulation is None:
        kind = "co-simulation" if described.coSimulation is not None else "no co-simulation"
        raise InputError(
            f"{path}: expected an FMU of FMI 2 or 3 for co-simulation; it is of FMI "
            f"{described.fmiVersion}, {kind}. Choose that where it is exported."
        )
    if fmpy.platform not in there:
        raise InputError(
            f"{path}: expected an FMU with a binary for {fmpy.platform}; it has "
            f"{', '.join(there) or 'none'}. Export it for this platform, or run it on that."
        )
    return described


def _require(path: Path, role: str, words, known: dict, fit: list[str], types: tuple) -> None:
    """Refuse variables that are missing, cannot be set, or hold other values. Raises InputError."""
    if isinstance(words, str):
        raise InputError(f"{path}: expected {role} as a list of names; got {words!r:.40}.")
    for word in words:
        variable = known.get(word)
        fits = word in fit and (not types or variable.type in types)
        if fits and not getattr(variable, "dimensions", None):
            continue
        kind = f"of type {' or '.join(types)}" if types else "of any type"
        can = [name for name in fit if not types or known[name].type in types]
        raise InputError(
            f"{path}: expected {role} among its scalar variables {kind}: {', '.join(can):.200}; "
            f"got {word!r:.60}."
        )


def _label(variable) -> str:
    return f"{variable.name} [{variable.unit}]" if variable.unit else variable.name
