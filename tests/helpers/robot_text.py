"""A module of one's own with a robot, as a text: of a name and a time step."""

ROBOT = """
import jax.numpy as jnp
import parc_jax as pj


class Folded:
    name, n_p, n_q = "{name}", 2, 1
    domain, time = pj.box([-1.0, -1.0], [1.0, 1.0]), pj.learning.time_grid({dt}, 1.0)

    def rollout(self, key, k):
        s = jnp.linspace(0.0, 1.0, self.time.n_record + 1)[:, None]
        return pj.Trajectory(s * jnp.array([k[0], jnp.abs(k[1])])[None], k[:1])


def system():
    return Folded()
"""
