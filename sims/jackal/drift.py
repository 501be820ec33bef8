"""How far dead reckoning goes wrong in one cycle of a loop: `python -m sims.jackal.drift`.

Robots for episodes drive chains of random manoeuvres. Of each cycle the motion that odometry tells
is compared with the true one, both in the frame of its start.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from parc_jax.common.keys import generator
from sims.jackal import params as c
from sims.jackal.driven import Driven
from sims.jackal.learn import HELD, robot
from sims.jackal.system import Jackal, framed


class Allowed(NamedTuple):
    """What a cycle may add: ahead and aside [m], half axes of an ellipse; turned [rad]."""

    ahead: float
    aside: float
    turned: float

    def holds(self, off) -> bool:
        """Is an error (3,) ahead, to the left [m], of the heading [rad] allowed?"""
        return bool(np.hypot(off[0] / self.ahead, off[1] / self.aside) <= 1) and (
            bool(abs(off[2]) <= self.turned)
        )


def allowed(before, after, slips, stood: int = 0) -> Allowed:
    """What a cycle between two measurements (2,) of speed [m/s] and turning [rad/s] is allowed to
    add. slips: (2,) [m/s] as of `slipped`. stood: for how many cycles the wheels have, this one
    among them: odometry says that it is where it was. What that is worth is measured here, not
    proved.
    """
    if stood:
        return Allowed(*c.DRIFT_STOOD[min(stood, 2) - 1])
    speed, turning = np.maximum(np.abs(before), np.abs(after))
    slip, slid = slips
    beyond = max(0.0, slid - c.GRIPS)
    return Allowed(*np.dot([1.0, speed, turning, speed * turning, slip, beyond], c.DRIFT))


def slipped(robot: Driven) -> np.ndarray:
    """(2,) [m/s] the most of `Driven.slips` in this cycle and the one before."""
    return robot.slips[-2 * robot.system.held :].max(axis=0)


def cycles_of(system: Jackal, key, options: "Options") -> np.ndarray:
    """(cycles, 6) of one chain, what each adds to the error: ahead, to the left [m], heading; and
    what it is `allowed` to add.
    """
    draws = generator(key)
    driven = Driven(system, (0.0, 0.0, 0.0), key)
    lo, hi = np.asarray(system.domain.lo)[-2:], np.asarray(system.domain.hi)[-2:]
    rows, stood = [], 0
    for _ in range(options.cycles):
        pose, told, before = driven.pose, driven.odometry, driven.measured
        if draws.uniform() > options.stops:
            driven.begin(*draws.uniform(lo, hi))
        driven.drive(system.moving)
        off = relative(told, driven.odometry) - relative(pose, driven.pose)
        stood = stood + 1 if np.array_equal(told, driven.odometry) else 0
        rows.append([*off, *allowed(before, driven.measured, slipped(driven), stood)])
    return np.array(rows)


def relative(pose, other) -> np.ndarray:
    """A pose (3,) in the frame of another."""
    return framed(np.stack([pose, other])[None])[0, 1]


@dataclass
class Options:
    """What to drive."""

    n: int = 1000
    """Chains."""
    cycles: int = 20
    """Manoeuvres of each, driven as long as their command is held."""
    stops: float = 0.2
    """Share of cycles in which no new manoeuvre begins."""
    seed: int = 0
    threads: int = 2


def main(argv: list[str] | None = None) -> None:
    """Command line."""
    import jax
    import tyro

    options = tyro.cli(Options, args=argv, prog="python -m sims.jackal.drift")
    driven = robot()
    keys = np.asarray(jax.random.split(jax.random.PRNGKey(options.seed), options.n))
    with ThreadPoolExecutor(options.threads) as pool:
        rows = np.concatenate(list(pool.map(lambda key: cycles_of(driven, key, options), keys)))
    print(f"{len(rows)} cycles of {HELD:g} s")
    units = {"ahead": "m", "aside": "m", "heading": "rad"}
    for (name, unit), off, most in zip(units.items(), np.abs(rows.T[:3]), rows.T[3:], strict=True):
        quantiles = ", ".join(f"{x:.4f}" for x in np.quantile(off, [0.5, 0.99, 1.0]))
        print(
            f"{name}: off by {quantiles} {unit} (median, 99 %, most); allowed for are "
            f"{np.median(most):.4f} {unit} in the median"
        )
    beyond = sum(not Allowed(*row[3:]).holds(row[:3]) for row in rows)
    print(f"{beyond} cycles were beyond what is allowed")


if __name__ == "__main__":
    main()
