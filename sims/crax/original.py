"""The original package over a pipe: run by a Python that has crax-bench 0.1.0, it prints what
happens in episodes of given seeds as JSON lines. `sims.crax.compared` reads it.
"""

import json
import sys

import numpy as np


def towards(seen: np.ndarray, draw: np.random.RandomState) -> np.ndarray:
    """An action of both, which brings its velocity towards the first goal, with some noise."""
    x, y = 0.8 * seen[44:46] - seen[3:5]
    return np.clip([0.1 * x, 1.5 * np.arctan2(y, x)] + 0.02 * draw.uniform(-1, 1, 2), -1, 1)


def main(level: str, seeds: str, steps: str) -> None:
    import jax

    jax.config.update("jax_enable_x64", True)
    import mujoco
    from crax import envs

    env = envs.get_environment("safe_goal_point", level=int(level))
    reset, step = jax.jit(env.reset), jax.jit(env.step)
    print(json.dumps({"mujoco": mujoco.__version__}), flush=True)
    for seed in map(int, seeds.split(",")):
        state, draw, rows = reset(jax.random.PRNGKey(seed)), np.random.RandomState(seed), []
        for _ in range(int(steps)):
            seen = np.asarray(state.obs)
            state = step(state, towards(seen, draw))
            data = state.pipeline_state
            row = [*data.qpos, *data.qvel, *seen, state.reward, state.info["cost"]]
            rows.append([float(x) for x in row])
        print(json.dumps({"seed": seed, "rows": rows}), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
