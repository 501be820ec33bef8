"""A scene of dynobench as a question: its boxes, walls around it, and its goal with room."""

import numpy as np

from parc_jax.common.sets.box import Box, box
from parc_jax.problem.body import Body, body_of, hull
from parc_jax.problem.problem import GoalOfPoints, Problem, goal_of_points, reach_avoid
from sims.foreign.dynobench.robots import BEND, ROBOTS, TRAILER_CORNERS, Robot
from sims.foreign.dynobench.scenes import Scene, scene
from sims.rectangle import CORNERS

NEAR, TURNED = 0.1, 0.2  # [m], [rad]: dynobench's goal is a state, ours all within this of it


def problem(robot: str = "unicycle1_v0", name: str = "parallelpark_0") -> Problem:
    """A scene by its name; ask it `at=` a pose. Raises InputError."""
    return problem_of(scene(robot, name))


def problem_of(asked: Scene) -> Problem:
    """The question of a scene."""
    robot = ROBOTS[asked.robot]
    return reach_avoid(goal_of(robot, asked.goal), obstacles(asked), body(robot))


def goal_of(robot: Robot, goal) -> GoalOfPoints:
    """All within NEAR and TURNED of a state, the trailer never bent more than dynobench allows."""
    middle = box(goal[:2] - NEAR, goal[:2] + NEAR)
    turns = goal[2:4] if robot.trailer else goal[2:3]
    lo, hi = turns - TURNED, turns + TURNED
    if robot.trailer:
        lo, hi = np.append(lo, -1.0), np.append(hi, BEND)
    return goal_of_points(robot.points, {"centre": middle}, box(lo, hi))


def obstacles(asked: Scene) -> tuple[Box, ...]:
    """Boxes and walls."""
    return asked.obstacles + asked.walls


def body(robot: Robot) -> Body:
    """The car's corners, and those of its trailer."""
    parts = [hull(*CORNERS), hull(*TRAILER_CORNERS)]
    return body_of(parts) if robot.trailer else parts[0]
