"""`parc-jax run`: the main job."""

import json
from functools import partial
from pathlib import Path
from typing import Annotated

from parc_jax.app.cli.options import Offer, Shell
from parc_jax.common.errors import InputError

# a study proves all that it finds
STUDY = Offer(
    "app.study.settings.Study", left_out="the study's, or ", but=("samples_only", "proof")
)


def run(
    system: str,
    /,
    *,
    out: Path | None = None,
    model: Path | None = None,
    case: tuple[int, ...] = (),
    study: Annotated[dict, STUDY],
    figures: bool = True,
    shell: Annotated[Shell, Offer("app.cli.options.Shell")],
) -> int:
    """Learn a system, find its safe set, prove it, replay it, draw it. Example: parc-jax run
    drift_parking

    A module with a function `job` runs that instead; it takes the options that make sense for it,
    and refuses the others.

    Args:
        system: A system of `parc-jax systems`, or a module of yours with `system()` and
            `problem()`.
        out: Folder for model, answer, metrics and figures. Default: runs/SYSTEM, with .NAME behind
            it where a module's system has another name than the module.
        model: A saved model, in place of rollouts and training.
        case: Numbers of cases, of a module's `job` that has them, as `parking`.
        figures: Draw the figures.
    """
    from parc_jax.app.cli.places import held, require_place
    from parc_jax.app.cli.process import during
    from parc_jax.app.cli.scene import code_of
    from parc_jax.app.cli.systems import black_box_of, build, find, study_of
    from parc_jax.app.study.job import METRICS, run_study
    from parc_jax.app.study.report import report
    from parc_jax.learning.model import load

    module = find(system, or_job=True)
    if hasattr(module, "job"):
        out = out or Path("runs") / system
        given = study | {"out": out, "model": model, "seed": shell.seed, "figures": figures}
        given["case"] = case or None
        with held(out):
            return build(module, "job", **given, quiet=shell.quiet, json=shell.json)
    if case:
        raise InputError(f"case: expected a module with a job that has cases; {system} has none.")
    settings = study_of(module, **study)
    black_box = learn_from = black_box_of(module, study.get("plant"), settings.body)
    if settings.plant and "plant" not in study:
        learn_from = black_box_of(module, settings.plant, settings.body)
    problem = build(module, "problem", body=settings.body)
    # neither modules whose systems share a name, nor systems of one module, share a folder
    alone = system.rpartition(".")[2] == black_box.name
    out = out or Path("runs") / (system if alone else f"{system}.{black_box.name}")
    for name in ("model.npz", "answer.json", METRICS):
        require_place(out / name)
    saved = None if model is None else load(model)  # refused before the long part
    with held(out):
        how = {"model": saved, "learn_from": learn_from, "figures": figures, "quiet": shell.quiet}
        said = partial(during, quiet=shell.quiet)
        outcome = run_study(
            black_box, problem, settings, out, shell.seed, **how, during=said, asked=study
        )
    print(json.dumps(outcome.metrics, indent=1) if shell.json else report(outcome, out))
    return code_of(outcome.answer)
