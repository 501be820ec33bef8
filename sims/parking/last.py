"""The whole safe set of the last manoeuvre, from anywhere near the goal with one heading: its share
and its picture. `python -m sims.parking.last`
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np
import shapely

import parc_jax as pj
from sims.parking import car as c
from sims.parking.cases import NEAR, Case, case
from sims.parking.kinematics import offset_from
from sims.parking.predict import model
from sims.parking.prove import goal_of
from sims.rectangle import rectangle

SHOWN = 60  # plans of a picture
SPAN = (-10.0, 13.0), (-2.6, 2.6)  # [m] of a picture, from the goal


def seen_from_goal(known: Case, turned: float = 0.0) -> Case:
    """A case in the frame of its goal, turned on by so much [rad]."""
    frame = known.goal + np.array([0.0, 0.0, turned])
    outlines = (np.column_stack([one, np.zeros(len(one))]) for one in known.outlines)
    return known._replace(
        start=offset_from(frame, known.start),
        goal=offset_from(frame, known.goal),
        outlines=tuple(offset_from(frame, one)[:, :2] for one in outlines),
    )


def last_set(seen: Case, settings: pj.Settings | None = None, seed: int = 0) -> pj.types.Answer:
    """Plans into the goal of a case by one manoeuvre from anywhere, with the heading 0 and the
    wheels turned as they may be. settings: as of `Planner.solve`.
    """
    here = shapely.Point(seen.goal[:2])
    near = [piece for piece, shape in seen.pieces if shape.distance(here) < NEAR]
    free = pj.Uncertainty(given={"steering before": "free", "start": c.AT_REST})
    problem = pj.reach_avoid(goal_of(seen, np.zeros(3)), near, rectangle(), uncertainty=free)
    return pj.Planner(model()).solve(problem, jax.random.PRNGKey(seed), settings)


def draw(place: Path, found: list) -> None:
    """Write cases with replays of their plans, one above the other: rear axles, starts, and in
    green the car at the ends.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 1.9 * len(found)), dpi=90, layout="constrained")
    for i, (seen, runs) in enumerate(found):
        axes = figure.add_subplot(len(found), 1, i + 1)
        for outline in seen.outlines:
            axes.fill(*outline.T, color="0.6", lw=0)
        points = runs.path[:SHOWN].reshape(len(runs.path[:SHOWN]), -1, len(c.POINTS), 2)
        for one in points:
            axes.fill(*one[0, 1:].T, facecolor="none", edgecolor="tab:blue", lw=0.4, alpha=0.5)
            axes.fill(*one[-1, 1:].T, facecolor="none", edgecolor="tab:green", lw=0.6)
            axes.plot(*one[:, 0].T, color="k", lw=0.6)
            axes.plot(*one[0, 0], ".", color="tab:orange", ms=4)
        axes.set(xlim=SPAN[0], ylim=SPAN[1], aspect="equal", ylabel="y [m]")
        axes.set_title(seen.name, fontsize=9)
    axes.set_xlabel("x [m]")
    figure.savefig(place)


@dataclass(frozen=True)
class Options:
    """Which cases, from which heading."""

    case: tuple[int, ...] = (1, 2, 7, 8)
    turned: float = 0.0
    """Degrees from the heading of the goal to that of the start."""
    out: Path = Path("runs/parking/last.png")


def drive(options: Options) -> None:
    """Search, replay, and say and draw what came of it. Raises InputError."""
    options.out.unlink(missing_ok=True)  # a picture of before is of other plans
    found = []
    for number in options.case:
        seen = seen_from_goal(case(number), np.radians(options.turned))
        answer = last_set(seen)
        print(f"case {number}:\n{answer.summary()}", flush=True)
        if len(answer.samples):
            key = jax.random.PRNGKey(1)
            runs = pj.replay(c.system(), answer.scene, answer.samples, key)
            print(told_of(runs), flush=True)
            found.append((seen, runs))
    if found:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        draw(options.out, found)
    print(f"Picture: {options.out}." if found else "No plan, and so no picture.")


def told_of(runs) -> str:
    """What came of a replay."""
    return (
        f"{len(runs.plans)} plans replayed: {runs.reached.sum()} reached the goal, "
        f"{runs.touched.sum()} touched something, {(~runs.inside).sum()} left the tube"
    )


if __name__ == "__main__":
    import tyro

    try:
        drive(tyro.cli(Options, description=__doc__))
    except pj.InputError as error:
        sys.exit(f"error: {error}")
