"""A policy that wants nothing but the goal, behind a certified shield: SafetyPointGoal1, hazards
known. docs/shield.md.

    python docs/examples/12_shield.py [STEPS]
"""

import sys

import numpy as np

import parc_jax as pj
import sims.point


def policy(seen: np.ndarray) -> np.ndarray:
    """Full thrust, turned to the sector of the lidar (12 to 27) that shows the goal."""
    sector = (int(np.argmax(seen[12:28])) + 8) % 16 - 8
    return np.array([1.0, np.clip(0.5 * (sector + 0.5), -1.0, 1.0)])


def episode(env, steps: int) -> list[dict]:
    seen, _ = env.reset(seed=3)
    told = []
    for _ in range(steps):
        seen, reward, *_, info = env.step(policy(seen))
        told.append(info | {"reward": reward})
    print(f"return {sum(x['reward'] for x in told):.1f}, cost {sum(x['cost'] for x in told):.0f}")
    return told


if __name__ == "__main__":
    bare = sims.point.PointGoal(1)
    env = pj.drive.Shield(bare, sims.point.model(), **sims.point.door())
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    without, behind = episode(bare, steps), episode(env, steps)
    assert sum(x["cost"] for x in behind) == 0
    changed = np.mean([x["shield"]["changed"] for x in behind])
    print(f"{100 * changed:.0f} % of actions were changed; the last: {behind[-1]['shield']}")
    print("parc-jax check", env.certificate("point.json"))
