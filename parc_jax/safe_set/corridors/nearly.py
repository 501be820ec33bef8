"""The quick test of bodies of several points: which of many plans keep to which of many corridors
at a few knots. [T27]

One obstacle and knot after another, plans innermost: what is worked on stays in cache, however many
the points are, and is read in order.
"""

import jax
import jax.numpy as jnp
from jaxtyping import ArrayLike, Bool, Int

from parc_jax.common.shapes import Index, Numbers, Paths
from parc_jax.safe_set.corridors.keeping import Conditions
from parc_jax.safe_set.separation.inequality import height, separates


def nearly_kept(conditions: Conditions, path: Paths, bins: Numbers, of: Int[ArrayLike, " c"]):
    """(b, c) bool: do plans meet the conditions of corridors at the beginning of some intervals,
    which are the knots of their paths? Kernel.
    """
    w = conditions.w[:, of].transpose(0, 3, 2, 1)  # (o, t, n_p, c)
    _, n_t, n_p, _ = w.shape
    support = conditions.least.support[:, of].transpose(0, 2, 1)  # (o, t, c)
    places = path.reshape(len(path), n_t, -1, n_p).transpose(1, 2, 3, 0)  # (t, n_points, n_p, b)
    # (t, n_points, ..., b)
    errors = jax.tree.map(lambda x: jnp.moveaxis(x[bins], 0, -1), conditions.least.errors)
    points = jnp.asarray(conditions.points)

    def at_knot(i: Index, met: Bool[ArrayLike, "b c"]):
        o, t = i // n_t, i % n_t
        own = jax.tree.map(lambda x: x[t][points[o]], (places, errors))
        # read before the loop over points, which would read it anew for each plan and corridor
        read = jax.lax.optimization_barrier((w[o, t][:, :, None], support[o, t][:, None], own))
        axes, least, (place, allowed) = read
        back = tuple(-x for x in axes)
        for slot in range(points.shape[1]):
            heights = height(axes, place[slot][:, None])
            mine = jax.tree.map(lambda x: jnp.moveaxis(x[slot], -1, 0)[None], allowed)  # noqa: B023
            met &= separates([heights], least + mine.support_by_axis(back))
        return met

    everywhere = jnp.ones((len(of), len(path)), bool)
    return jax.lax.fori_loop(0, conditions.count * n_t, at_knot, everywhere).T
