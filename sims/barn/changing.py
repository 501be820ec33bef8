"""BARN's worlds while they change: `python -m sims.barn.changing`. A person appears in full view of
the robot and stays, or some beams of its lidar end short of what stands. [T44]
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import jax
import numpy as np
import tyro

import parc_jax as pj
from parc_jax.common.spelling import rounded_down
from sims import barn
from sims.barn.contact import distance_to_cylinders
from sims.barn.drive import Driven, drive
from sims.barn.job import WORLDS
from sims.jackal import learn
from sims.lidar import Lidar, lidar

TICKS = 10  # of a cycle


@dataclass
class Changing:
    """A lidar in whose world a person appears, some metres ahead and aside of the robot, in a
    cycle, and of whose beams a share ends short of what stands.
    """

    lidar: Lidar
    person: tuple[float, float, float] | None = None  # ahead, aside, radius [m]
    cycle: int = 0
    short: float = 0.0
    cycles: int = 0
    there: np.ndarray | None = None

    def __post_init__(self):
        self.draw = np.random.default_rng(0)

    @property
    def sweep(self) -> float:
        return self.lidar.sweep

    def pose(self, robot):
        return self.lidar.pose(robot)

    def scan(self, robot, stands, rng):
        if self.person is not None and self.cycles >= self.cycle:
            if self.there is None:
                cos, sin = np.cos(robot[2]), np.sin(robot[2])
                ahead, aside, radius = self.person
                away = [cos * ahead - sin * aside, sin * ahead + cos * aside]
                self.there = np.append(robot[:2] + away, radius)
            stands = replace(stands, circles=np.vstack([stands.circles, self.there]))
        self.cycles += 1
        scan = self.lidar.scan(robot, stands, rng)
        bad = self.draw.uniform(size=len(scan.ranges)) < self.short
        ends = self.draw.uniform(size=len(bad)) * scan.ranges
        return replace(scan, ranges=np.where(bad, ends, scan.ranges))

    def gap_of(self, done: Driven) -> float:
        """[m] least distance from the robot to the person."""
        since, size = done.path[TICKS * self.cycle :], learn.robot().size
        return distance_to_cylinders(since, size, self.there[None, :2], self.there[2]).min()


@dataclass(frozen=True)
class Options:
    """What changes, in which worlds."""

    worlds: tuple[int, ...] = WORLDS
    """Numbers of worlds; default: the dozen of `parc-jax run barn`."""
    person: tuple[float, float, float] = (1.5, 0.0, 0.25)
    """[m] ahead and aside of the robot, and radius."""
    cycle: int = 12
    """When the person appears."""
    short: float = 0.01
    """Share of beams that end short of what stands."""


def driven(loop: pj.drive.Loop, number: int, sight: Changing, odometry: bool) -> Driven:
    """A drive through a world of that number."""
    key = jax.random.PRNGKey(0)
    return drive(barn.world(number), learn.robot(), loop, key, sight, odometry)


def main(options: Options) -> Iterable[str]:
    """Drive all of it; rows of a table in Markdown."""
    from sims.barn.driver import content_of, loop_of

    loop = loop_of(learn.MODEL, content_of(learn.MODEL))
    whole = lidar(beams=720, max_range=30.0)
    changes = {
        "a person": {"person": options.person, "cycle": options.cycle},
        f"{100 * options.short:g} % of beams short": {"short": options.short},
    }
    yield "| what changes | pose | reached | touched | drifted beyond | nearest to the person |"
    yield "|---|---|---|---|---|---|"
    for name, change in changes.items():
        for odometry in (False, True):
            sights = [Changing(whole, **change) for _ in options.worlds]
            done = [
                driven(loop, number, sight, odometry)
                for number, sight in zip(options.worlds, sights, strict=True)
            ]
            near = [s.gap_of(d) for s, d in zip(sights, done, strict=True) if s.there is not None]
            touched = sum(one.touched for one in done) + sum(gap <= 0 for gap in near)
            yield (
                f"| {name} | {'odometry' if odometry else 'true'} "
                f"| {sum(one.reached for one in done)} of {len(done)} | {touched} "
                f"| {sum(one.drifted > 0 for one in done)} "
                f"| {f'{rounded_down(100 * min(near))} cm' if near else ''} |"
            )


if __name__ == "__main__":
    for line in main(tyro.cli(Options, description=__doc__)):
        print(line, flush=True)
