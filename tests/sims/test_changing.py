"""A world that changes while the packaged Jackal drives: who appears and stays is not driven into,
and false returns cost no drive. [T44]
"""

from dataclasses import dataclass, replace

import jax
import numpy as np
import pytest
from needs import need

import parc_jax as pj
from sims import barn
from sims.barn.contact import distance_to_cylinders
from sims.barn.drive import drive
from sims.jackal import learn
from sims.lidar import Lidar, lidar
from sims.rectangle import rectangle

pytestmark = pytest.mark.slow
TICKS = 10  # of a cycle


@pytest.fixture(scope="module")
def loop():
    need("shapely")
    v, w = np.linspace(-0.8, 1.6, 17), np.linspace(-1.3, 1.3, 15)
    return pj.drive.Loop(
        learn.model(),
        rectangle(),
        leave=learn.HELD,
        candidates=np.stack(np.meshgrid(v, w, indexing="ij"), axis=-1).reshape(-1, 2),
        thinking=learn.thinking(),
        effort=pj.drive.Effort(judged=255, looks=4096, room=0.05, deadline=learn.THINKS),
        clock=lambda: 0.0,
    )


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

    def clearance(self, done) -> float:
        """[m] least distance from the robot to the person."""
        since, size = done.path[TICKS * self.cycle :], learn.robot().size
        return distance_to_cylinders(since, size, self.there[None, :2], self.there[2]).min()


def driven(loop, world, sight, odometry):
    return drive(world, learn.robot(), loop, jax.random.PRNGKey(0), sight, odometry)


@pytest.mark.soundness
@pytest.mark.parametrize("odometry", [False, True])
@pytest.mark.parametrize("person", [(2.0, 0.0, 0.25), (1.5, 0.6, 0.3)])
def test_who_appears_in_full_view_and_stays_is_driven_around(loop, odometry, person):
    import shapely

    sight = Changing(lidar(beams=541), person, cycle=12)
    done = driven(loop, barn.world(1), sight, odometry)
    assert sight.clearance(done) > 0 and not done.touched and not done.drifted and done.reached
    off = 0.1 if odometry else 1e-6  # [m] that the frame of what is known is off, at most
    stands = shapely.Point(sight.there[:2]).buffer(sight.there[2] - off)
    assert not any(free.region.intersects(stands) for free in done.free[sight.cycle :])


@pytest.mark.parametrize("odometry", [False, True])
def test_false_returns_of_a_hundredth_of_the_beams_cost_no_drive(loop, odometry):
    sight = Changing(lidar(beams=541), short=0.01)
    done = driven(loop, barn.world(1), sight, odometry)
    assert done.reached and not done.touched and done.seconds < 12.0
