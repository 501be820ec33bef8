"""The shortest gap between two cars along a street that is parked in, each manoeuvre proved, beside
what the geometry allows; and what a pose costs that the search follows.
`python -m sims.parking.shortest`
"""

import sys
import time
from dataclasses import dataclass
from typing import NamedTuple

import jax
import numpy as np

import parc_jax as pj
from sims.parking import car as c
from sims.parking.cases import Case, case_of
from sims.parking.drive import drive
from sims.parking.guide import BUDGET, Guide
from sims.parking.known import Exact, Learned
from sims.parking.predict import model
from sims.parking.prove import loop_of

GAPS = (7.0, 6.4, 6.0, 5.8, 5.6, 5.4, 5.2, 5.1)  # [m]
CURB, STREET = 0.3, 5.5  # [m] beside a parked car: to the curb, and to what is across the street
AHEAD, BESIDE = 1.5, 0.9  # [m] of the start from the gap's front, and from the car there
LONG = 20.0  # [m] of curb and of street, to either side


class Gap(NamedTuple):
    """What came of a gap of a length [m]. found: manoeuvres of a way that is clear of everything
    without a tube; driven: of the proved ones, no tube of which was left; None without. nearest:
    [m] on the true poses. each: [s] of processor time for each pose that a search with tubes
    follows.
    """

    length: float
    found: int | None
    driven: int | None
    nearest: float
    each: float


def one_stroke() -> float:
    """[m] of the shortest gap that the car leaves forwards, and so enters backwards, in one stroke
    at full steering, without error: its outer front corner passes the corner of the car in front.
    """
    radius, front = c.WHEELBASE / np.tan(c.STEERING), c.LENGTH - c.BEHIND
    return float(c.BEHIND + np.sqrt(front**2 + 2 * radius * c.WIDTH))


def street(gap: float) -> Case:
    """A gap [m] between two cars like this one, parallel to a curb; the car stands in the street,
    beside the front one, and its goal is the middle of the gap.
    """
    spare, side = 0.5 * (gap - c.LENGTH), 0.5 * c.WIDTH
    rear, front = -c.BEHIND - spare, c.LENGTH - c.BEHIND + spare

    def block(x, y):
        return [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]]

    long, beside = (-LONG, LONG), (-side, side)
    obstacles = [
        block((rear - c.LENGTH, rear), beside),
        block((front, front + c.LENGTH), beside),
        block(long, (-side - CURB - 1.0, -side - CURB)),
        block(long, (side + STREET, side + STREET + 1.0)),
    ]
    start = [front + AHEAD, c.WIDTH + BESIDE, 0.0]
    return case_of(f"a gap of {gap:.2f} m", start, [0.0, 0.0, 0.0], obstacles)


def tried(gap: float, seed: int = 0) -> Gap:
    """Search for a way without a tube, and park."""
    known = street(gap)
    found = Guide(known, Exact(known, tube=0.0), rolling=False).search()
    one = drive(known, loop_of(), jax.random.PRNGKey(seed))
    well = one.reached and one.proved and not (one.touched or one.left)
    return Gap(
        length=gap,
        found=None if found is None else len(found.k),
        driven=len(one.commitments) if well else None,
        nearest=one.clearance,
        each=cost_of_a_pose(known),
    )


def cost_of_a_pose(known: Case) -> float:
    """[s] of processor time for each pose that a search with the tubes of the model follows."""
    guide = Guide(known, Learned(known, model()))
    begin = time.process_time()
    guide.first(known.start)
    return (time.process_time() - begin) / max(1, BUDGET - guide.budget)


@dataclass(frozen=True)
class Options:
    """Which gaps."""

    gaps: tuple[float, ...] = GAPS
    """[m] of curb between the two cars."""


def tabled(options: Options) -> None:
    """Try each, and print its row. Raises InputError."""
    if not all(c.LENGTH < gap < np.inf for gap in options.gaps):
        raise pj.InputError(f"gaps: expected each longer than the car, {c.LENGTH} m, and finite.")
    print(f"one stroke, by the geometry: {one_stroke():.2f} m; the car {c.LENGTH:.2f} m")
    print("| gap [m] | manoeuvres without a tube | proved | nearest [cm] | ms a pose |")
    print("|---|---|---|---|---|")
    for gap in options.gaps:
        row = tried(gap)
        shown = ("none" if n is None else str(n) for n in (row.found, row.driven))
        nearest = np.floor(100 * row.nearest)
        cells = [f"{gap:g}", *shown, f"{nearest:.0f}", f"{1e3 * row.each:.1f}"]
        print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    import tyro

    try:
        tabled(tyro.cli(Options, description=__doc__))
    except pj.InputError as error:
        sys.exit(f"error: {error}")
