"""Dynobench's scenes and the solutions that it stores beside them, read from the package."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box, box
from sims.foreign.dynobench.process import ask
from sims.foreign.dynobench.robots import ROBOTS

SCENES = ("parallelpark_0", "kink_0", "bugtrap_0")
WALL = 1.0  # [m] how thick the walls around a scene are


@dataclass(frozen=True, eq=False)
class Scene:
    """A scene for one robot. lo, hi (2,) [m]: of where the robot's middle may be in dynobench;
    here all of it stays inside. obstacles: boxes. start, goal (n_x,): states.
    """

    robot: str
    name: str
    lo: np.ndarray
    hi: np.ndarray
    obstacles: tuple[Box, ...]
    start: np.ndarray
    goal: np.ndarray

    @property
    def walls(self) -> tuple[Box, ...]:
        """Around the scene."""
        (x, y), (u, v) = self.lo, self.hi
        w = WALL
        return (
            box([x - w, y - w], [x, v + w]),
            box([u, y - w], [u + w, v + w]),
            box([x, y - w], [u, y]),
            box([x, v], [u, v + w]),
        )


@dataclass(frozen=True, eq=False)
class Solution:
    """What dynobench stores. planner: that found it. cost: [s]. feasible: by its own word. states
    (n + 1, n_x), controls (n, n_u): a row every 0.1 s.
    """

    planner: str
    cost: float
    feasible: bool
    states: np.ndarray
    controls: np.ndarray


def scene(robot: str, name: str) -> Scene:
    """One of SCENES for one of ROBOTS. Raises InputError."""
    about = _read(_folder(robot) / f"{_known(name)}.yaml")
    around = about["environment"]
    obstacles = []
    for one in around["obstacles"]:
        if one["type"] != "box":
            raise InputError(f"{name}: expected boxes alone; got an obstacle of {one['type']!r}.")
        middle, half = np.array(one["center"], float), np.array(one["size"], float) / 2
        obstacles.append(box(middle - half, middle + half))
    driven = about["robots"][0]
    lo, hi, start, goal = (
        np.array(values, float)
        for values in (around["min"], around["max"], driven["start"], driven["goal"])
    )
    return Scene(robot, name, lo, hi, tuple(obstacles), start, goal)


def solutions(robot: str, name: str) -> list[Solution]:
    """All that are stored of a scene, cheapest first."""
    found = []
    for path in sorted((_folder(robot) / _known(name)).glob("*_solution_*.yaml")):
        about = _read(path)
        found.append(
            Solution(
                path.stem,
                float(about["cost"]),
                bool(about["feasible"]),
                np.array(about["states"], float),
                np.array(about["actions"], float),
            )
        )
    return sorted(found, key=lambda one: one.cost)


def reference(robot: str, name: str) -> Solution:
    """The cheapest stored one that dynobench calls feasible."""
    return next(one for one in solutions(robot, name) if one.feasible)


def _folder(robot: str) -> Path:
    if robot not in ROBOTS:
        raise InputError(f"robot: expected one of {', '.join(ROBOTS)}; got {robot!r}.")
    return Path(ask("folder")) / "envs" / robot


def _known(name: str) -> str:
    if name not in SCENES:
        raise InputError(f"scene: expected one of {', '.join(SCENES)}; got {name!r}.")
    return name


def _read(path: Path) -> dict:
    import yaml

    return yaml.safe_load(path.read_text(encoding="utf-8"))
