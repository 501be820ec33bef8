"""Obstacles from a map and from a lidar scan: unknown is never free.

The robot is a platform that slides with a velocity k for a second. Needs the extra `maps`.
"""

import jax
import numpy as np

import parc_jax as pj
from sims.lidar import lidar, shapes


def platform(robot):
    """A model of it; its tube of 2 cm is declared here, not shown by runs."""
    share = np.linspace(0, 1, 5)[:, None]  # of the way, at the knots
    slide = np.kron(share, np.tile(np.eye(2), (5, 1)))[2:]  # five points, two coordinates each
    net = pj.learning.relu_network([slide], [np.tile(robot.places.ravel(), 5)[2:]])
    time = pj.learning.time_grid(dt=0.25, t_f=1.0, dt_record=0.05)
    widths = np.full((1, 4, 10), 0.02), np.full((1, 10), 0.02)
    tube = pj.learning.tube([np.array([-2.0, 2.0])] * 2, *widths, 5)
    claim = pj.learning.declared_claim(tube, "this file", net, time, points=robot.points)
    return pj.learning.trajectory_model(net, claim)


if __name__ == "__main__":
    corners = "[[0.21, 0.165], [0.21, -0.165], [-0.21, -0.165], [-0.21, 0.165]]"
    robot = pj.problem.read_footprint(corners)  # as Nav2 spells it
    planner, key = pj.Planner(platform(robot)), jax.random.key(0)

    cells = np.zeros((80, 80), np.int8)  # nav_msgs/OccupancyGrid: 0 free, 100 occupied, -1 unknown
    cells[38:42, :34] = cells[38:42, 46:] = 100  # a wall with a door of 0.6 m
    hall = pj.problem.occupancy_grid(cells, resolution=0.05, origin=(-2.0, -2.0, 0.0))
    ahead = pj.problem.goal_of_points(robot.points, {"base": pj.box([-0.1, 0.6], [0.1, 1.0])})
    problem = pj.reach_avoid(ahead, hall.free_space().obstacles(), robot.body)
    answer = planner.solve(problem, key, pj.Settings(samples=20), at=[0.0, -0.8])
    print("through the door of the map:", answer.summary())

    pose, posts = np.array([0.0, -0.8, 0.0]), shapes(np.array([[0.6, -0.2], [-0.7, 0.1]]), 0.15)
    scan = lidar(noise=0.01).scan(pose, posts, np.random.default_rng(0))
    seen = pj.problem.seen_from(
        scan.pose, scan.angles, scan.ranges, max_range=scan.max_range, noise=scan.noise, width=0.1
    )
    free = pj.problem.free_place(robot.corners(pose), margin=0.3).add(seen)  # looked around
    edges = free.near(pose, reach=2.0).obstacles()  # the edge of all that is free for sure
    problem = pj.reach_avoid(ahead, edges, robot.body)
    answer = planner.solve(problem, key, pj.Settings(samples=20), at=pose[:2])
    print("by one scan:", answer.summary())
    assert answer.status is pj.types.Status.PROVED
