"""Instances of the suite about its toys, with scenes of a test's own, and what is true of them."""

import json
from dataclasses import replace

import numpy as np

from benchmarks.suite.boxes import puck
from benchmarks.suite.instances import instances
from benchmarks.suite.scene import Scene, free

START = np.array([[-0.5, -0.5], [0.5, 0.5]])
GOAL = np.array([[1.6, -0.4], [2.4, 0.4]])
LO, HI = np.array([-0.5, -0.5, 1.0, -1.0]), np.array([0.5, 0.5, 3.0, 1.0])  # of plans


def case(box="puck", goal=GOAL, start=START, **changes):
    """An instance about a goal with nothing in the way."""
    one = replace(instances("large", ["puck_01"])[0], box=box, **changes)
    one.__dict__["scene"] = Scene(start, goal[:, None], free(0), (([0], 0.1),), ())
    return one


def fails(plans, goal=GOAL, gust=puck.GUST):
    """How often plans (n, 4) of the puck fail in truth: their ends differ by a uniform gust."""
    ends = plans[:, :2] + puck.pushed(plans[:, 2:])
    within = np.minimum(goal[1], ends + gust) - np.maximum(goal[0], ends - gust)
    return 1 - np.clip(within / (2 * gust), 0, 1).prod(axis=1)


def grid(n=40):
    """Plans (n^4, 4), evenly over all."""
    sides = [lo + (np.arange(n) + 0.5) / n * (hi - lo) for lo, hi in zip(LO, HI, strict=True)]
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 4)


def reaching(goal=GOAL, most=2.5):
    """The polytope of plans whose ends, without a gust, are in the goal, of pushes that do not
    slip.
    """
    A = np.array([[1, 0, 1, 0], [-1, 0, -1, 0], [0, 1, 0, 1], [0, -1, 0, -1]])
    b = np.array([goal[1, 0], -goal[0, 0], goal[1, 1], -goal[0, 1]])
    hi = np.minimum(HI, [9, 9, most, 9])
    return {"A": A.tolist(), "b": b.tolist(), "lo": LO.tolist(), "hi": hi.tolist()}


def robust(goal=GOAL, gust=puck.GUST):
    """The polytope of those that no gust throws out of the goal."""
    return reaching(goal + np.array([[gust], [-gust]]))


def text(verdict="some", **told) -> bytes:
    """The bytes of an answer."""
    return json.dumps({"verdict": verdict, **told}).encode()
