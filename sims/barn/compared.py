"""What a proof costs: the same loop in the same worlds with other tubes, side by side.

learned: as the claim has it, the only one of which anything is shown. constant: as NeuralPARC has
it, at each time the largest error of all runs, whatever k. none:
the predicted path alone has to be free.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np
import tyro

import parc_jax as pj
from parc_jax.common.spelling import rounded_down
from parc_jax.learning.bound.pipeline import learn_profile
from parc_jax.learning.bound.tube import Tube
from sims.barn import series
from sims.barn.job import WORLDS
from sims.jackal.learn import MODEL, robot

RESTS = 1e-4  # [m] that a network may move while the robot rests, else no loop takes it


@dataclass(frozen=True)
class Options:
    """Which model, in which worlds."""

    model: Path = MODEL
    """The Jackal's; the one that comes along."""
    runs: int = 12_000
    """Of the robot, whose largest errors the constant tube has."""
    worlds: tuple[int, ...] = WORLDS
    """Numbers of worlds; default: the dozen of `parc-jax run barn`."""
    out: Path = Path("runs/barn/compared.jsonl")
    """A line for each episode; what a model drove there is not driven again."""
    odometry: bool = True
    """The robot knows where it is by dead reckoning alone; else it truly knows."""
    jobs: int = series.Options().jobs
    """Processes."""
    quiet: bool = False
    """No progress bars."""


def main(options: Options) -> str:
    """Drive all of it; returns a table in Markdown."""
    rows = [
        "| tube | reached | touched | left its tube | metric | time, median and most | nearest |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, model in models(options):
        asked = {field: getattr(options, field) for field in ("worlds", "out", "odometry", "quiet")}
        told, _ = series.drive_worlds(series.Options(model=model, jobs=options.jobs, **asked))
        rows.append(row(name, told))
    return "\n".join(rows)


def row(name: str, told: list[dict]) -> str:
    """Of one tube."""
    n, well = len(told), [one for one in told if one["reached"] and not one["touched"]]
    seconds = [one["seconds"] for one in well] or [np.nan]
    return (
        f"| {name} | {len(well)} of {n} | {sum(one['touched'] for one in told)} | "
        f"{sum(one['left'] for one in told)} | {np.mean([one['metric'] for one in told]):.3f} | "
        f"{np.median(seconds):.1f} s, {max(seconds):.1f} s | "
        f"{rounded_down(min(one['clearance'] for one in told))} m |"
    )


def models(options: Options) -> Iterator[tuple[str, Path]]:
    """Names and files of all three; the other two are written beside what was driven."""
    model = pj.load(options.model)
    sides = [[lo, hi] for lo, hi in zip(model.domain.lo, model.domain.hi, strict=True)]
    key, kept = jax.random.PRNGKey(0), options.out.parent / "runs.npz"
    runs = pj.learning.collect(robot(), key, n=options.runs, path=kept, quiet=options.quiet)
    constant = learn_profile(model.net, runs, (), sides, shape="box")
    nothing = constant.with_halves(*(np.full_like(each, RESTS) for each in constant.halves))
    yield "learned", options.model
    for name, tube, why in (
        ("constant", constant, "no run of those drawn was farther off"),
        ("none", nothing, "nobody asked how far the robot may be from its prediction"),
    ):
        path = options.out.parent / f"{name}.npz"
        with_tube(model, tube, why).save(path)
        yield name, path


def with_tube(model: pj.types.TrajectoryModel, tube: Tube, why: str) -> pj.types.TrajectoryModel:
    """The network with a tube of which nothing is shown."""
    about = {"system": model.system, "points": model.points, "rotation": model.rotation}
    about |= {"labels": model.labels, "given": model.given}
    claim = pj.learning.declared_claim(tube, why, model.net, model.time, **about)
    return pj.learning.trajectory_model(model.net, claim)


if __name__ == "__main__":
    print(main(tyro.cli(Options, description=__doc__)))
