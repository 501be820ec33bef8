"""Door 2: an environment with a policy, run in worker processes. Gymnasium's interface, without
needing Gymnasium.

Worker processes import this file, so everything they run is at the top level and the start is
guarded below.
"""

from pathlib import Path

import jax
import numpy as np

import parc_jax as pj


class SkidEnv:
    """The cart as an environment: state (x, y, heading, time). gymnasium.make(...) gives one like
    it.
    """

    dt = 0.05

    def reset(self, *, seed=None, options=None):
        """A grip for this episode, the cart at the origin."""
        self.grip = 1 + 0.05 * np.random.default_rng(seed).normal()
        self.state = np.zeros(4)
        return self.state, {}

    def step(self, action):
        """action = (speed, turn rate)."""
        x, y, heading, t = self.state
        speed, rate = action
        self.state = np.array(
            [
                x + self.dt * speed * np.cos(heading),
                y + self.dt * speed * np.sin(heading),
                heading + self.dt * self.grip * rate,
                t + self.dt,
            ]
        )
        return self.state, 0.0, False, False, {}


def policy(observation, k):
    """k = (speed, turn) steers a controller that could as well be a trained network."""
    t = observation[3]
    return k[0] * (1.5 - t), 2 * k[1] * t


def position(environment, observation):
    """Workspace position (x, y) [m]."""
    return observation[:2]


def heading(environment, observation):
    """Final heading [rad], wrapped by nobody."""
    return observation[2:3]


def system(workers=None):
    """The black box: one process per core unless told otherwise."""
    time = pj.learning.time_grid(dt=0.1, t_f=1.0, dt_record=SkidEnv.dt)
    episode = pj.learning.EnvironmentRun(SkidEnv, policy, time.n_record, position, heading)
    domain = pj.box([0.5, -0.5], [1.0, 0.5])
    return pj.python_system(
        episode, domain, time, name="skid_env", n_p=2, n_q=1, workers=workers, law={"grip": 0.05}
    )


if __name__ == "__main__":
    import runpy

    ask = runpy.run_path(str(Path(__file__).with_name("02_jax_function.py")))["ask"]
    black_box = system(workers=2)
    answer = ask(black_box, jax.random.PRNGKey(0))
    black_box.close()
    print(answer.details())
    print("a safe plan (p0, k):", answer.samples[0])
