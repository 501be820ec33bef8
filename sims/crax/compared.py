"""Our world beside the original package, which runs in a Python of its own, over a pipe:

    python -m sims.crax.compared --python PYTHON [--level 2]

PYTHON has crax-bench 0.1.0, which pins MuJoCo 3.11 and steps it in JAX, here in float64, as ours.
Each step sets out from the original's joints and speeds: its turning motor is stiffer than its step
allows, a chaos in which two roundings are apart after some tens of steps. Goals, and the draws of
their places, are ours from the first step to the last. When the original tells what is sensed at
its start, all its hazards still lie on the robot, and touches are solved otherwise. Prints the
largest difference of joints, speeds, observations, rewards and costs, and when they part.
"""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from sims.crax.original import towards
from sims.crax.world import LEVELS, World
from sims.point.compared import parted, rows_of


@dataclass
class Options:
    """What to compare."""

    python: Path
    """A Python that has crax-bench 0.1.0."""
    level: int = 1
    seeds: int = 3
    steps: int = 1000


def ours(level: int, seed: int, theirs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of an episode as `original.py` prints them, theirs (n, 70): each of our steps is the
    same action from the joints and speeds at which they were; and which steps touched something.
    """
    world, draw = World(LEVELS[level], seed), np.random.RandomState(seed)
    rows, touched = [], []
    for i, seen in enumerate(theirs[:, 6:-2]):
        if i:
            world.data.qpos[:], world.data.qvel[:] = theirs[i - 1, :6].reshape(2, 3)
        own = world.observation()
        reward, info = world.step(towards(seen, draw))
        rows.append([*world.data.qpos, *world.data.qvel, *own, reward, info["cost"]])
        touched.append(info["touched"] > 0)
    return np.array(rows), np.array(touched)


def main() -> None:
    import tyro

    options = tyro.cli(Options, description=__doc__)
    seeds = range(options.seeds)
    about = (str(options.level), ",".join(map(str, seeds)), str(options.steps))
    theirs, original = rows_of(options.python, Path(__file__).with_name("original.py"), *about)
    print(f"original on MJX {theirs}, ours on MuJoCo {mujoco.__version__}: level {options.level}")
    for seed, one in zip(seeds, original, strict=True):
        other, touched = ours(options.level, seed, one)
        free = ~touched
        free[1:] &= ~touched[:-1]  # what is seen tells of the step before
        free[0] = False
        print(parted(one, other))
        print(f"  of the {free.sum()} steps after the first that touch nothing:")
        print(parted(one, other, free))


if __name__ == "__main__":
    main()
