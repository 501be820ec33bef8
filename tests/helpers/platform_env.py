"""A platform that slides after a commanded velocity, as a Gymnasium environment and a model."""

import gymnasium
import numpy as np

import parc_jax as pj
from parc_jax.common.keys import generator

LAG, HELD, T_F = 0.1, 0.4, 1.2  # [s]
TIME = pj.learning.time_grid(dt=0.1, t_f=T_F, dt_record=0.1)
WIDTH = 0.02  # [m] of the declared tube


def ways(t):
    """[s] how far a speed at the start, and a command held for HELD, lead within t."""
    before, after = np.minimum(t, HELD), np.maximum(t - HELD, 0.0)
    fades = LAG * (1 - np.exp(-before / LAG))
    rests = LAG * (1 - np.exp(-after / LAG))
    of_start = fades + np.exp(-HELD / LAG) * rests
    return of_start, before - fades + (1 - np.exp(-HELD / LAG)) * rests


class Platform(gymnasium.Env):
    """Posts (m, 2) [m] are the lower corners of boxes of 0.2 m. heavier: factor on what it does."""

    def __init__(self, posts=((1.0, -0.1),), heavier=1.0, actions=2):
        self.posts, self.heavier = np.array(posts), heavier
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (actions,))
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (4,))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.place, self.speed = np.zeros(2), np.zeros(2)
        return self.seen(), {}

    def step(self, action):
        (start,), (command,) = (np.reshape(way, 1) for way in ways(np.array(HELD)))
        action = self.heavier * np.asarray(action, np.float64)
        self.place = self.place + start * self.speed + command * action
        self.speed = action + (self.speed - action) * np.exp(-HELD / LAG)
        reward = float(self.place[0])
        return self.seen(), reward, False, False, {"cost": float(self.inside())}

    def seen(self):
        return np.concatenate([self.place, self.speed])

    def inside(self, radius=0.2):
        away = np.maximum(np.maximum(self.posts - self.place, self.place - self.posts - 0.2), 0.0)
        return bool((np.linalg.norm(away, axis=1) <= radius).any())


class PlatformSystem:
    """The black box of the same robot. off: share by which what it does differs between runs."""

    name, n_p, n_q, given = "platform", 2, 0, (0, 1)
    domain, time = pj.box([-1.0] * 4, [1.0] * 4), TIME

    def __init__(self, heavier=1.0, off=0.0):
        self.heavier, self.off = heavier, off

    def rollout_batch(self, keys, ks):
        of_start, of_command = ways(TIME.dt_record * np.arange(TIME.n_record + 1))
        ks = np.asarray(ks)
        command = ks[:, None, 2:] * self.heavier
        if self.off:
            share = [1 + self.off * generator(key).uniform(-1, 1) for key in keys]
            command = command * np.reshape(share, (-1, 1, 1))
        p = ks[:, None, :2] * of_start[:, None] + command * of_command[:, None]
        return pj.Trajectory(p, np.zeros((len(ks), 0)))


def platform_net() -> pj.types.ReLUNetwork:
    """Exact."""
    knots = np.stack(ways(TIME.dt * np.arange(1, TIME.n_steps + 1)), axis=1)
    return pj.learning.relu_network([np.kron(knots, np.eye(2))], [np.zeros(2 * TIME.n_steps)])


def platform_model() -> pj.types.TrajectoryModel:
    """Exact, with a tube that is declared."""
    net = platform_net()
    tube = pj.learning.tube(
        [[-1.0, 1.0]] * 4, np.full((1, TIME.n_steps, 2), WIDTH), np.full((1, 2), WIDTH)
    )
    claim = pj.learning.declared_claim(
        tube, "this test declares it", net, TIME, system="platform", given=(0, 1)
    )
    return pj.learning.trajectory_model(net, claim)


def sense(env, seen):
    posts = [pj.box(corner, corner + 0.2) for corner in env.unwrapped.posts]
    return pj.drive.Sensed(seen[:2], seen[2:], posts)


def act(k, seconds, given):
    return np.asarray(k)[2:] if seconds < HELD / 2 else np.zeros(2)


def shielded(env=None, model=None, **options):
    """The environment behind its shield."""
    given = {
        "system": PlatformSystem(),
        "body": 0.2,
        "every": HELD,
        "sense": sense,
        "ask": lambda action: action,
        "act": act,
        "effort": pj.drive.Effort(candidates=64, judged=64, deadline=300.0),
    }
    model = platform_model() if model is None else model
    return pj.drive.Shield(Platform() if env is None else env, model, **(given | options))
