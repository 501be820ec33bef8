"""How far dead reckoning goes wrong in one cycle of a loop: `python -m sims.jackal.drift`.

Robots drive chains of random manoeuvres. Of each cycle the motion that odometry tells is compared
with the true one, both in the frame of its start.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from parc_jax.base.keys import generator
from sims.jackal import params as c
from sims.jackal.driven import Driven
from sims.jackal.system import Jackal, framed, system


def allowed(before, after, stood: bool = False) -> tuple[float, float]:
    """[m] and [rad] that a cycle between two measurements (2,) of speed [m/s] and turning [rad/s]
    is allowed to add. stood: the wheels did, all the while: odometry says that it is where it was.
    What that is worth is measured here, not proved.
    """
    if stood:
        return c.DRIFT_STOOD
    speed, turning = np.maximum(np.abs(before), np.abs(after))
    (still, per_speed), (straight, per_turning) = c.DRIFT_MOVED, c.DRIFT_TURNED
    return still + per_speed * speed, straight + per_turning * turning


def cycles_of(robot: Jackal, key, options: "Options") -> np.ndarray:
    """(cycles, 5) of one chain, what each adds to the error: ahead, to the left [m], heading; and
    what it is allowed to add.
    """
    draws = generator(key)
    driven = Driven(robot, (0.0, 0.0, 0.0), key)
    lo, hi = np.asarray(robot.domain.lo)[2:], np.asarray(robot.domain.hi)[2:]
    rows = []
    for _ in range(options.cycles):
        pose, told, before = driven.pose, driven.odometry, driven.measured
        if draws.uniform() > options.stops:
            driven.begin(*draws.uniform(lo, hi))
        driven.drive(robot.moving)
        off = relative(told, driven.odometry) - relative(pose, driven.pose)
        stood = np.array_equal(told, driven.odometry)
        rows.append([*off, *allowed(before, driven.measured, stood)])
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
    robot = system(threads=1)
    keys = np.asarray(jax.random.split(jax.random.PRNGKey(options.seed), options.n))
    with ThreadPoolExecutor(options.threads) as pool:
        rows = np.concatenate(list(pool.map(lambda key: cycles_of(robot, key, options), keys)))
    print(f"{len(rows)} cycles of {c.MOVING:g} s")
    found = np.hypot(*rows[:, :2].T), np.abs(rows[:, 2])
    for name, unit, off, most in zip(
        ("place", "heading"), "m rad".split(), found, rows.T[3:], strict=True
    ):
        quantiles = ", ".join(f"{x:.4f}" for x in np.quantile(off, [0.5, 0.99, 1.0]))
        print(
            f"{name}: off by {quantiles} {unit} (median, 99 %, most); allowed for are "
            f"{np.median(most):.4f} {unit} in the median; {(off > most).sum()} cycles were beyond"
        )


if __name__ == "__main__":
    main()
