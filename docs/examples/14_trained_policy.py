"""A policy that stable-baselines3 trains without a thought of hazards, driven with and without the
shield: SafetyPointGoal1, hazards known. docs/shield.md.

    pip install stable-baselines3; python docs/examples/14_trained_policy.py [STEPS]
"""

import sys

from stable_baselines3 import PPO

import parc_jax as pj
import sims.point
from sims.point.film import film, frame


def drive(env, policy, steps: int = 500) -> list:
    seen, info = env.reset(seed=10)
    frames = [frame(env, info)]
    for _ in range(steps):
        seen, *_, info = env.step(policy.predict(seen)[0])
        frames.append(frame(env, info))
    return frames


if __name__ == "__main__":
    bare = sims.point.PointGoal(1)
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    policy = PPO("MlpPolicy", bare, seed=0).learn(steps)
    env = pj.drive.Shield(bare, sims.point.model(), **sims.point.door())  # the one line
    drives = {"without the shield": drive(bare, policy), "with the shield": drive(env, policy)}
    print({name: sum(one.cost for one in frames) for name, frames in drives.items()})
    print("film:", film("trained.gif", bare.world.hazards, drives))
