"""Our world, printed as `original.py` prints the original. Needs NumPy and MuJoCo alone."""

import json
import sys
from pathlib import Path

import mujoco
import numpy as np


def towards(lidar: np.ndarray, draw: np.random.RandomState) -> np.ndarray:
    """An action of both: full thrust, turned to the sector that shows the goal, with some noise."""
    sector = (int(np.argmax(lidar)) + 8) % 16 - 8
    return np.clip([1.0, 0.5 * (sector + 0.5)] + 0.2 * draw.uniform(-1, 1, 2), -1, 1)


def main(robot: str, level: str, seeds: str, steps: str) -> None:
    sys.path.insert(0, str(Path(__file__).parent))
    from world import LEVELS, ROBOTS, World

    print(json.dumps({"mujoco": mujoco.__version__}), flush=True)
    for seed in map(int, seeds.split(",")):
        world = World(LEVELS[int(level)], seed, ROBOTS[robot])
        world.costs()
        draw, rows = np.random.RandomState(seed), []
        for _ in range(int(steps)):
            seen = np.concatenate([*world.observation().values()]).tolist()
            data = world.data
            state = [*world.place, *data.qpos[:3], *data.qvel[:3]]
            action = towards(np.array(seen[-48:-32]), draw)
            reward, info = world.step(action)
            rows.append([*map(float, state), *seen, reward, info["cost_sum"]])
        print(json.dumps({"seed": seed, "rows": rows}), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
