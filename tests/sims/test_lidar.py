"""The lidar against a ray caster of plain loops, and against what can be said by hand."""

import math

import numpy as np
import pytest

from sims.lidar import Lidar, Shapes, cast, lidar, shapes
from sims.sweep import swept


def plain(pose, angles, world: Shapes) -> list[float]:
    """Beam by beam, shape by shape: roots of a quadratic, and sides of a line."""
    return [min([math.inf, *_meetings(pose, float(angle), world)]) for angle in angles]


def _meetings(pose, angle, world):
    ux, uy = math.cos(pose[2] + angle), math.sin(pose[2] + angle)
    for x, y, radius in world.circles.tolist():
        x, y = x - pose[0], y - pose[1]
        half, rest = x * ux + y * uy, x * x + y * y - radius * radius
        if half > 0 and half * half >= rest:
            yield half - math.sqrt(half * half - rest)
    for (ax, ay), (bx, by) in world.edges.tolist():
        ax, ay, bx, by = ax - pose[0], ay - pose[1], bx - pose[0], by - pose[1]
        left, right = ux * ay - uy * ax, ux * by - uy * bx
        if left * right <= 0 and left != right:
            share = left / (left - right)
            far = ux * (ax + share * (bx - ax)) + uy * (ay + share * (by - ay))
            if far >= 0:
                yield far


def drawn_world(seed: int) -> Shapes:
    """Circles, boxes and triangles around the origin, none nearer than 0.5 m."""
    draw = np.random.default_rng(seed)
    far, at = draw.uniform(1.0, 9.0, 40), draw.uniform(-np.pi, np.pi, 40)
    places = np.column_stack([far * np.cos(at), far * np.sin(at)])
    boxes = np.column_stack([places[:10] - 0.1, places[:10] + draw.uniform(0.0, 0.15, (10, 2))])
    corners = [place + draw.uniform(-0.3, 0.3, (3, 2)) for place in places[10:20]]
    return shapes(places[20:], draw.uniform(0.03, 0.3, 20), corners, boxes)


@pytest.mark.parametrize("view", [1.5 * np.pi, 2 * np.pi, 0.3])
@pytest.mark.parametrize("seed", range(4))
def test_ranges_are_those_of_plain_loops(seed, view):
    world, sensor = drawn_world(seed), lidar(beams=181, view=view)
    for pose in ([0.0, 0.0, 0.0], [0.1, -0.2, 3.0], [0.0, 0.1, -40.0]):
        found = cast(np.array(pose), sensor.angles, world)
        np.testing.assert_allclose(found, plain(pose, sensor.angles, world), rtol=0, atol=1e-9)


def test_a_wall_ahead_and_one_along_the_beam():
    sensor = lidar(beams=3, view=np.pi, mount=(0.0, 0.0, 0.0))
    ahead = shapes(boxes=[[2.0, -5.0, 3.0, 5.0]])
    np.testing.assert_allclose(sensor.scan((0, 0, 0), ahead).ranges, [10.0, 2.0, 10.0])
    along = Shapes(np.empty((0, 3)), np.array([[[1.5, 0.0], [4.0, 0.0]]]))
    np.testing.assert_allclose(sensor.scan((0, 0, 0), along).ranges, [10.0, 1.5, 10.0])
    astride = Shapes(np.empty((0, 3)), np.array([[[-1.0, 0.0], [4.0, 0.0]]]))
    assert sensor.scan((0, 0, 0), astride).ranges[1] == 0.0


def test_noise_is_bounded_as_declared_and_only_on_what_was_hit():
    world, sensor = drawn_world(1), Lidar()
    true = sensor.scan((0, 0, 0), world)
    noisy = sensor.scan((0, 0, 0), world, np.random.default_rng(5))
    off = noisy.ranges - true.ranges
    assert np.abs(off).max() <= noisy.noise == 0.01
    assert np.abs(off[true.returned]).max() > 0.009 and not off[~true.returned].any()
    again = sensor.scan((0, 0, 0), world, np.random.default_rng(5))
    np.testing.assert_array_equal(again.ranges, noisy.ranges)


def test_each_beam_of_a_sweep_is_cast_from_its_own_pose():
    """Against the plain loops, beam by beam, from a robot that drives, turns and passes shapes
    closely, while some of them move.
    """
    draw, sensor = np.random.default_rng(3), lidar(beams=181, sweep=0.1, noise=0.0, max_range=99.0)
    assert sensor.moments[0] == -0.1 and sensor.moments[-1] == 0.0
    share = np.linspace(0.0, 1.0, sensor.beams)[:, None]
    for seed in range(6):
        world = drawn_world(seed)
        poses = draw.uniform(-0.3, 0.3, 3) + share * draw.uniform([-1, -1, -0.6], [1, 1, 0.6])
        walks = share[..., None] * draw.uniform(-0.5, 0.5, (1, len(world.circles), 3)) * [1, 1, 0]
        moving = Shapes(world.circles + walks, world.edges)
        for shown in (world, moving):
            found = sensor.scan(poses, shown)
            at, circles = sensor.pose(poses), np.broadcast_to(shown.circles, moving.circles.shape)
            each = [
                plain(one, [angle], Shapes(now, world.edges))[0]
                for one, angle, now in zip(at, sensor.angles, circles, strict=True)
            ]
            inside = np.linalg.norm(circles[..., :2] - at[:, None, :2], axis=-1) <= circles[..., 2]
            each = np.where(inside.any(axis=1), 0.0, np.minimum(each, sensor.max_range))
            np.testing.assert_allclose(found.ranges, each, rtol=0, atol=1e-9)
            np.testing.assert_array_equal(found.pose, at[sensor.beams // 2])


def test_a_late_beam_of_a_sweep_is_of_the_later_pose():
    sensor = lidar(beams=3, view=np.pi, mount=(0.0, 0.0, 0.0), sweep=0.1)
    around = shapes(boxes=[[-3.0, -3.0, 3.0, -2.0], [-3.0, 2.0, 3.0, 3.0], [2.0, -2.0, 3.0, 2.0]])
    away = np.array([[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [1.0, 1.0, 0.0]])
    np.testing.assert_allclose(sensor.scan(away, around).ranges, [2.0, 1.5, 1.0])
    turned = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, -np.pi / 3]])
    np.testing.assert_allclose(
        sensor.scan(turned, around).ranges, [2.0, 2.0, 2.0 / np.cos(np.pi / 6)]
    )


@pytest.mark.soundness
@pytest.mark.parametrize("gap", [0.01, 0.05])
@pytest.mark.parametrize("sign", [1, -1])
def test_the_motion_between_two_beams_is_bounded_also_where_poses_are_off(gap, sign):
    """Poses that are off hide a part of how fast a robot moves and turns."""
    sweep, beam, arm, speed, turning = 0.02, 2.8e-4, 0.12, 0.3, 1.0
    times, moments = gap * (np.arange(-4, 5) - 0.3), np.arange(0.0, sweep, beam)

    def robot(t):
        return np.stack([speed * t, 0.0 * t, turning * t], axis=1)

    hidden = np.array([0.004, 0.0, 0.005])  # [m], [m], [rad] of the way from one pose to the next
    told = robot(times) + sign * (-1.0) ** np.arange(9)[:, None] * hidden / 2
    off = hidden[0] + hidden[2] * arm, hidden[2]
    known = swept(times, told, sweep, beam, arm, (0.0, 0.0), off)
    steps = np.diff(lidar(mount=(arm, 0.0, 0.0)).pose(robot(moments)), axis=0)
    assert np.linalg.norm(steps[:, :2], axis=1).max() <= known.between[0] + 1e-12
    assert np.abs(steps[:, 2]).max() <= known.between[1] + 1e-12
