"""The Jackal that crosses a crowd: as fast backwards as it is forwards, and quicker to change its
speed than that of `sims.jackal.learn`, since who walks may turn at any moment. `python -m
sims.dynabarn.robot --out model.npz` learns its model anew.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import parc_jax as pj
from sims.jackal import learn as jackal
from sims.jackal.learn import HELD, THINKS
from sims.jackal.system import Jackal, system

MODEL = Path(__file__).with_name("model.npz")
SPEED, TURNING = 2.0, 1.5  # [m/s], [rad/s] most that is commanded, backwards too
RAMP = (4.0, 10.0)  # [m/s^2], [rad/s^2] of the command; the tyres hold about 4.9 m/s^2
T_FINAL = 1.0  # [s] when the robot rests
EDGES = {
    "speed at the start": (-1.3, -0.7, -0.12, 0.12, 0.7, 1.3),
    "speed": (-1.0, -0.15, 0.15, 1.0),
}


def robot(threads: int = 1) -> Jackal:
    """The Jackal, over its wheels."""
    most = {"speed": SPEED, "turning": TURNING, "backward": SPEED, "ramp": RAMP}
    return system(moving=HELD, t_f=T_FINAL, thinking=THINKS, threads=threads, **most)


@cache
def model() -> pj.types.TrajectoryModel:
    """The model that comes along."""
    return pj.load(MODEL)


@dataclass(frozen=True)
class Options(jackal.Options):
    """How much of it."""

    out: Path = Path("model.npz")
    rollouts: int = 24_000
    train_steps: int = 16_000


if __name__ == "__main__":
    import tyro

    options = tyro.cli(Options, description=__doc__)
    learned = jackal.learn(options, robot(options.threads), EDGES)
    learned.save(options.out)
    print(learned.claim)
