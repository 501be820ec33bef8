"""A lidar alone in worlds of the BARN challenge: what is free is free."""

from collections import deque

import numpy as np
import pytest
from needs import need

need("shapely")
import shapely  # noqa: E402

import sims.barn  # noqa: E402
from parc_jax.problem.world.free_space import free_place  # noqa: E402
from parc_jax.problem.world.outlines import read_footprint  # noqa: E402
from parc_jax.problem.world.seen import seen_from  # noqa: E402
from sims.lidar import lidar, shapes  # noqa: E402

ROBOT = read_footprint("[[0.21, 0.165], [0.21, -0.165], [-0.21, -0.165], [-0.21, 0.165]]")
UNCERTAINTY = (0.01, 0.003)  # [m], [rad]
GRID, ROOM = 0.1, 0.32  # [m] corners are 0.27 m from the middle


def way(world) -> list[np.ndarray]:
    """Poses from the start to the far side, ROOM from the cylinders, by breadth-first search."""
    begin = tuple(np.round(world.start[:2] / GRID).astype(int))
    before, waiting = {begin: begin}, deque([begin])
    while waiting:
        here = waiting.popleft()
        if here[1] * GRID >= world.goal[1]:
            break
        for step in ((0, 1), (1, 0), (-1, 0), (0, -1), (1, 1), (-1, 1)):
            there = (here[0] + step[0], here[1] + step[1])
            place = GRID * np.array(there)
            gap = np.hypot(*(world.cylinders - place).T).min() - world.radius
            if there not in before and gap > ROOM and place[1] > 2.5:
                before[there] = here
                waiting.append(there)
    cells = [here]
    while before[cells[-1]] != cells[-1]:
        cells.append(before[cells[-1]])
    places = GRID * np.array(cells[::-2])
    ahead = np.diff(places, axis=0)
    return [np.array([*p, np.arctan2(d[1], d[0])]) for p, d in zip(places, ahead, strict=False)]


def driven(number: int) -> tuple[np.ndarray, np.ndarray]:
    """At each pose the pieces near the robot, and whether it is held inside of them. Along the way
    nothing may stand where all is free.
    """
    world, sensor, rng = sims.barn.world(number), lidar(), np.random.default_rng(number)
    seen = shapes(world.cylinders, world.radius)
    stands = shapely.buffer(shapely.points(world.cylinders), world.radius)
    free, counts, held = None, [], []
    for truth in way(world):
        turn = rng.uniform(0, 2 * np.pi)
        off = np.array([np.cos(turn), np.sin(turn), 0]) * UNCERTAINTY[0]
        off[2] = rng.choice([-1, 1]) * UNCERTAINTY[1]
        scan = sensor.scan(truth, seen, rng)
        limits = {
            "max_range": scan.max_range,
            "noise": scan.noise,
            "width": 0.1,
            "uncertainty": UNCERTAINTY,
        }
        found = seen_from(scan.pose + off, scan.angles, scan.ranges, **limits)
        free = (free or free_place(ROBOT.corners(truth), 0.15)).add(found).within(truth, 4.0)
        assert not shapely.intersects(free.region, stands).any()
        near = free.near(truth, 1.6)
        held.append(near.holds(ROBOT.corners(truth)))
        counts.append(len(near.obstacles()))
    return np.array(counts), np.array(held)


@pytest.mark.night
def test_in_all_worlds_nothing_stands_in_what_was_seen():
    drives = [driven(number) for number in sims.barn.numbers()]
    counts, held = (np.concatenate(told) for told in zip(*drives, strict=True))
    assert np.mean(counts <= 64) > 0.98 and held.mean() > 0.95
