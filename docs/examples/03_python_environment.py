"""Door 2: an environment with a policy, in worker processes. Gymnasium's interface, without
Gymnasium. Workers import this file: they run what is at the top level, and the start is guarded.
"""

import runpy
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj


class SkidEnv:
    """The cart as an environment: state (x, y, heading, time), as gymnasium.make(...) gives one."""

    dt = 0.05

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


def position(environment, observation):
    """Workspace position (x, y) [m]."""
    return observation[:2]


def heading(environment, observation):
    """Final heading [rad], not wrapped."""
    return observation[2:3]


if __name__ == "__main__":
    time = pj.learning.time_grid(dt=0.1, t_f=1.0, dt_record=SkidEnv.dt)
    episode = pj.learning.EnvironmentRun(SkidEnv, policy, time.n_record, position, heading)
    box, law = pj.box([0.5, -0.5], [1.0, 0.5]), {"grip": 0.05}
    robot = pj.python_system(episode, box, time, name="env", n_p=2, n_q=1, workers=2, law=law)

    ask = runpy.run_path(str(Path(__file__).with_name("02_jax_function.py")))["ask"]
    answer = ask(robot, jax.random.PRNGKey(0))
    robot.close()
    print(answer.details())
    print("a safe plan (p0, k):", answer.samples[0])
