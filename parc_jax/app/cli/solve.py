"""`parc-jax solve`: the safe set of one scene."""

from pathlib import Path
from typing import Annotated

from parc_jax.app.cli.options import Offer, Shell
from parc_jax.safe_set.settings import Settings

UNCERTAINTY = Offer(
    "problem.uncertainty.Uncertainty",
    left_out="the scene's, or ",
    named={name: f"uncertainty_{name}" for name in ("start", "heading", "k", "goal")},
    kinds={
        "start": tuple[float, ...],
        "heading": float,
        "goal": tuple[float, ...],
        **dict.fromkeys(("k", "given", "unknown"), tuple[str, ...]),
        "sensing_eps": str,
    },
)


def solve(
    model: Path,
    scene: Path | None = None,
    /,
    *,
    out: Path = Path("answer.json"),
    system: str | None = None,
    settings: Annotated[
        Settings, Offer("safe_set.settings.Settings", but=("samples_only", "proof"))
    ],
    at: str | None = None,
    first: bool = False,
    validate: bool = False,
    runs: Path | None = None,
    study: Annotated[dict, Offer("app.study.settings.Study", left_out="", only=("risk",))],
    uncertainty: Annotated[dict, UNCERTAINTY],
    shell: Annotated[Shell, Offer("app.cli.options.Shell")],
) -> int:
    """Find and prove the safe starts and parameters of a scene. Example: parc-jax solve
    drift_parking --first

    With your files: parc-jax solve model.npz scene.toml

    A scene file names a goal, obstacles, a body and optionally a start set; `parc-jax systems NAME`
    prints one. --uncertainty-..., --given, --unknown and --sensing-eps replace entries of its table
    [uncertainty].

    Args:
        model: A model of `parc-jax learn` or `parc-jax run`, or a system of `parc-jax systems`
            whose model comes along.
        scene: The scene, a .toml file. Default: that of the model's system.
        out: The answer file, with certificates; it is written in every case but bad input.
        system: The model's system, by name or by the module that makes it, which --validate runs
            if the model keeps no runs; a model of another is refused. Default: the one it names.
        at: Where the robot is, x,y or x,y,heading: which k may it drive from here? With a heading
            [rad] the scene is solved in the robot's frame. Default: from anywhere in its start set.
        first: Stop at the first plan, proved: no sets, no shares.
        validate: Run the model's system in this scene too: the largest of nested sets of plans, of
            which one drawn at random fails with probability at most --risk, or 0.003, kept beside
            --out as .validated.json. Its runs grow as 1 / risk.
        runs: Recorded runs to validate with instead, at a risk of 0.15 with confidence 0.95 by
            default. A model of a log keeps its own, and validates by default where no risk of a
            drawn plan is stated, or a larger one.
    """
    import sys

    from parc_jax.answer.why import odd_size
    from parc_jax.app.cli.places import require_place
    from parc_jax.app.cli.process import COMPILING, SEARCHING, say
    from parc_jax.app.cli.scene import (
        as_json,
        beside,
        code_of,
        place_of_option,
        under_uncertainty,
        verdict,
    )
    from parc_jax.app.cli.systems import asked_of, black_box_with, find
    from parc_jax.app.study.report import validated
    from parc_jax.common.errors import InputError
    from parc_jax.common.keys import key_of
    from parc_jax.learning.labels import degrees_hint
    from parc_jax.method import FirstProved
    from parc_jax.planner import Planner
    from parc_jax.safe_set.verdict.outline import require_same

    if model.suffix == ".toml" and scene is not None and scene.suffix == ".npz":
        got = f"{model} and {scene}. Swap the two."
        raise InputError(f"solve: expected the model first and then the scene; got {got}")
    if first and (validate or runs or study):
        raise InputError("validate: expected a whole set, which --first does not look for.")
    require_place(out)
    learned, given = asked_of(model, scene)
    if system not in (None, learned.system):
        require_same(black_box_with(find(system, needed=("system",)), learned.points), learned)
    problem = under_uncertainty(given, uncertainty)
    planner = Planner(learned)
    place = place_of_option(at)
    planner.prepare(problem, at=place)  # a misfit is refused before the long part
    tests = validate or runs or study
    asked = _tests(learned, system or learned.system, runs, **study) if tests else None
    odd = odd_size(problem, planner.model)
    if odd is None and place is not None and len(place) > planner.model.n_p:
        odd = degrees_hint("heading [rad]", place[-1], place[-1]).strip()
    if odd:
        print(odd, file=sys.stderr)
    cold_s = None
    if first:
        say("looking for a safe plan", shell.quiet)
        one = {"samples": 1, "proof": True, "method": FirstProved()}
        settings = Settings.fast().replace(budget_s=settings.budget_s, **one)
    else:
        # so that the times are those of the search and not of the compiler
        say(COMPILING, shell.quiet)
        cold_s = planner.warm_up(problem, settings, at=place).cover.timings["first_sample_s"]
        say(SEARCHING, shell.quiet)
    answer = planner.solve(problem, key_of(shell.seed), settings, at=place, validate=asked)
    answer.save(out)
    beside(out).unlink(missing_ok=True)  # of an earlier answer
    if (wider := validated(answer)) is not None:
        wider.save(beside(out))
    print(as_json(answer, out, cold_s) if shell.json else verdict(answer, out, shell.quiet))
    return code_of(answer)


def _tests(model, system: str, runs: Path | None, risk: float | None = None):
    from parc_jax.app.cli.systems import black_box_with, find
    from parc_jax.drive.local.validation import Validate
    from parc_jax.learning.runs.loaders import load_rollouts

    if runs is not None:
        return Validate(load_rollouts(runs, model.time, points=model.points), risk)
    if model.held is not None:
        return Validate(model.held, risk)
    return Validate(black_box_with(find(system, needed=("system",)), model.points), risk)
