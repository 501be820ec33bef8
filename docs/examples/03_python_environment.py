"""Door 2: an environment with a policy, in worker processes. Gymnasium's interface, without
Gymnasium. Workers import this file: they run what is at the top level, and the start is guarded.
"""

import runpy
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj

TIME = pj.learning.time_grid(dt=0.1, t_f=1.0, dt_record=0.05)


class SkidEnv:
    """The cart as an environment: state (x, y, heading, time), as gymnasium.make(...) gives one."""

    dt = TIME.dt_record

    def reset(self, *, seed=None, options=None):
        """A grip for this episode, the cart at the origin."""
        self.grip = 1 + 0.05 * np.random.default_rng(seed).normal()
        self.state = np.zeros(4)
        return self.state, {}

    def step(self, action):
        """action = (speed, turn rate)."""
        heading, (speed, rate) = self.state[2], action
        change = [speed * np.cos(heading), speed * np.sin(heading), self.grip * rate, 1.0]
        self.state = self.state + self.dt * np.array(change)
        return self.state, 0.0, False, False, {}


def policy(observation, k):
    """k = (speed, turn) steers a controller that could as well be a trained network."""
    t = observation[3]
    return k[0] * (1.5 - t), 2 * k[1] * t


def episode(rng, k):
    """One episode under k: places (n_record + 1, 2) [m] and the final heading [rad], unwrapped."""
    environment = SkidEnv()
    seen, _ = environment.reset(seed=int(rng.integers(2**31)))
    places = [np.array(seen[:2])]  # a copy: many environments write into the same array
    for _ in range(TIME.n_record):
        seen, _, terminated, truncated, _ = environment.step(policy(seen, k))
        places.append(np.array(seen[:2]))
        if (terminated or truncated) and len(places) <= TIME.n_record:
            raise RuntimeError("the episode ended early")  # this run has failed
    return np.stack(places), seen[2:3]


if __name__ == "__main__":
    box, law = pj.box([0.5, -0.5], [1.0, 0.5]), {"grip": 0.05}
    robot = pj.python_system(episode, box, TIME, name="env", n_p=2, n_q=1, workers=2, law=law)

    ask = runpy.run_path(str(Path(__file__).with_name("02_jax_function.py")))["ask"]
    answer = ask(robot, jax.random.PRNGKey(0))
    robot.close()
    print(answer.details())
    print("a safe plan (p0, k):", answer.samples[0])
