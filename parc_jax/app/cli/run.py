"""`parc-jax run`: the main job."""

import json
import sys
from functools import partial
from pathlib import Path
from typing import Annotated

from parc_jax.app.cli.offer import Offer
from parc_jax.app.cli.shell import Shell


def run(
    system: str,
    /,
    *,
    out: Path | None = None,
    model: Path | None = None,
    study: Annotated[dict, Offer("app.study.settings.Study", left_out="the study's, or ")],
    figures: bool = True,
    shell: Annotated[Shell, Offer("app.cli.shell.Shell")],
) -> int:
    """Learn a system, find its safe set, prove it, replay it, draw it. Example: parc-jax run
    drift_parking

    A module may have a study of its own, a function `job`, and then that is what runs; it takes the
    options that make sense for it, and refuses the others.

    Args:
        system: A system of `parc-jax systems`, or a module of your own with `system()` and
            `problem()`.
        out: Folder for model, answer, metrics and figures. Default: runs/SYSTEM, with .NAME behind
            it where a module's system has another name than the module.
        model: A saved model, in place of rollouts and training.
        figures: Draw the figures.
    """
    from parc_jax.answer.answer import Answer
    from parc_jax.app.cli.help import fitted
    from parc_jax.app.cli.lock import held
    from parc_jax.app.cli.places import require_place
    from parc_jax.app.cli.saying import during
    from parc_jax.app.cli.systems import black_box_of, build, find, study_of
    from parc_jax.app.cli.unfinished import only_of
    from parc_jax.app.study.cache import keep_compiled
    from parc_jax.app.study.job import METRICS, UNFINISHED, Studied, finish, run_study
    from parc_jax.app.study.numbers import eps_of
    from parc_jax.app.study.report import figures as draw_figures
    from parc_jax.app.study.report import report
    from parc_jax.learning.model import load

    if shell.cache:
        keep_compiled()
    module = find(system, or_job=True)
    if hasattr(module, "job"):
        out = out or Path("runs") / system
        with held(out):
            return build(
                module,
                "job",
                **study | {"out": out, "model": model},
                seed=shell.seed,
                figures=figures,
                quiet=shell.quiet,
                json=shell.json,
            )
    asked = study_of(module, **study)
    black_box = learn_from = black_box_of(module, study.get("plant"), asked.body)
    if asked.plant and "plant" not in study:
        learn_from = black_box_of(module, asked.plant, asked.body)
    problem = build(module, "problem", body=asked.body)
    out = out or Path("runs") / _own_name(system, black_box.name)
    for name in ("model.npz", "answer.json", METRICS):
        require_place(out / name)
    saved = None if model is None else load(model)

    def first(answer: Answer) -> None:
        """A picture of the first plans, long before all is done."""
        from parc_jax.app.plot.samples import samples

        picture = out / UNFINISHED / "samples.png"
        samples(answer, None, picture)
        if not shell.quiet:
            so_far = f"a claim with eps = {eps_of(answer.model.claim)}, so far"
            print(
                f"{black_box.name}: first plans are in {picture}, proved under {so_far}.",
                file=sys.stderr,
            )

    def early(outcome: Studied) -> None:
        """Pictures, and where the answer is, before the plan that is driven."""
        if figures:
            files = draw_figures(outcome, asked, out)
            outcome.metrics["figures"] = [file.name for file in files]
            finish(out, outcome.metrics)
        if asked.driven and not shell.quiet:
            print(f"{black_box.name}: the answer is in {out}.", file=sys.stderr)

    with held(out), only_of(module, out / UNFINISHED):
        outcome = run_study(
            black_box,
            problem,
            asked,
            out,
            shell.seed,
            model=saved,
            quiet=shell.quiet,
            learn_from=learn_from,
            first=first if figures else None,
            early=early,
            during=partial(during, quiet=shell.quiet),
        )
    if shell.json:
        print(json.dumps(outcome.metrics, indent=1))
    else:
        print(fitted(report(outcome)))
        print(f"Written to {out}. Verify with: parc-jax check {out / 'answer.json'}")
    return 0 if outcome.answer.status.found else 1


def _own_name(typed: str, name: str) -> str:
    """What the results of a system are kept under: modules whose systems share a name, and systems
    that share a module, do not share a folder.
    """
    return typed if typed.rpartition(".")[2] == name else f"{typed}.{name}"
