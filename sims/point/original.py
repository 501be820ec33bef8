"""The original package over a pipe: run by a Python that has safety-gymnasium 1.0.0, it prints what
happens in episodes of given seeds as JSON lines. `sims.point.compared` reads it.
"""

import json
import sys
from pathlib import Path

import numpy as np


def main(task: str, seeds: str, steps: str) -> None:
    import mujoco
    import safety_gymnasium

    sys.path.insert(0, str(Path(__file__).parent))
    from ours import towards

    env = safety_gymnasium.make(task)
    print(json.dumps({"mujoco": mujoco.__version__}), flush=True)
    for seed in map(int, seeds.split(",")):
        seen, _ = env.reset(seed=seed)
        task_of, draw = env.unwrapped.task, np.random.RandomState(seed)
        rows = []
        for _ in range(int(steps)):
            data = task_of.data
            state = [*data.body("agent").xpos[:2], *data.qpos[:3], *data.qvel[:3]]
            before = np.asarray(seen).tolist()
            action = towards(np.asarray(before[-48:-32]), draw)
            seen, reward, cost, *_ = env.step(action)
            rows.append([*map(float, state), *before, float(reward), float(cost)])
        print(json.dumps({"seed": seed, "rows": rows}), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
