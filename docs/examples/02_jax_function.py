"""Door 1: a JAX function. A skidding cart; one rollout is written down, the rest is vmapped and
compiled.
"""

import jax
import jax.numpy as jnp

import parc_jax as pj


class Skid:
    """k = (speed, turn). The cart drives, its wheels lose grip at random, and it slides to a halt
    after one second.
    """

    name, n_p, n_q = "skid", 2, 1
    domain = pj.box([0.5, -0.5], [1.0, 0.5])
    time = pj.learning.time_grid(dt=0.1, t_f=1.0, dt_record=0.05)

    def rollout(self, key, k):
        """p (21, 2) relative to the start, q = final heading."""
        return self.rollout_from(key, k, jnp.zeros(2, k.dtype))

    def rollout_from(self, key, k, p0):
        """The same from p0: lets translation invariance be measured."""
        t = self.time.dt_record * jnp.arange(self.time.n_record + 1, dtype=k.dtype)
        grip = 1 + 0.05 * jax.random.normal(key, (), k.dtype)
        heading = grip * k[1] * t**2
        step = self.time.dt_record * k[0] * (1.5 - t)[:-1, None]
        path = p0 + jnp.cumsum(
            step * jnp.stack([jnp.cos(heading), jnp.sin(heading)], axis=1)[:-1], axis=0
        )
        return pj.Trajectory(jnp.concatenate([p0[None], path]) - p0, heading[-1:])


def ask(system, key, n=600):
    """Learn the system, then ask from where and with which k it surely passes a block and stops in
    the goal.
    """
    data = pj.learning.collect(system, key, n=n, quiet=True)
    net = pj.learning.train(data, hidden=(8, 8), key=key, seeds=2, steps=400)
    claim = pj.learning.bound_error(
        net, system, key, eps=0.02, delta=0.01, bins=(2, 2), train=data, quiet=True
    )
    model = pj.learning.trajectory_model(net, claim)
    return solve(model, key)


def solve(model, key):
    """The same scene for every door."""
    scene = pj.reach_avoid(
        pj.box([0.7, -0.3, -0.4], [1.3, 0.3, 0.4]), [pj.box([0.2, 0.25], [0.5, 0.5])], 0.1
    )
    return pj.Planner(model).solve(scene, jax.random.PRNGKey(1), pj.Settings())


if __name__ == "__main__":
    key = jax.random.PRNGKey(0)
    gap = pj.learning.translation_gap(Skid(), key, starts=[[10.0, -3.0], [-400.0, 80.0]])
    print("moving the start moves the run by", gap.p, gap.q)
    answer = ask(Skid(), key)
    print(answer.details())
    print("a safe plan (p0, k):", answer.samples[0])
