"""A profile from training runs alone, and tubes on finer bins."""

from dataclasses import replace

import jax
import numpy as np

from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.bound.edges import choose_edges, edges_of
from parc_jax.learning.bound.measure import measure
from parc_jax.learning.bound.profile import largest_errors, smooth_profile


def on_finer(tube, edges):
    """The same tube on finer edges, which contain its own."""
    middles = np.meshgrid(*(0.5 * (np.asarray(e[1:]) + e[:-1]) for e in edges), indexing="ij")
    source = tube.bin_of(np.stack(middles, axis=-1).reshape(-1, len(edges)))
    parts = (tube.interval, tube.final, tube.templates)
    interval, final, templates = jax.tree.map(lambda x: x[source], parts)
    edges = tuple(map(np.asarray, edges))
    return replace(tube, edges=edges, interval=interval, final=final, templates=templates)


def training_profile(net, train, bins=None, floor=TOLERANCES.profile_floor):
    """As learnt from the finite ones of these runs. bins: None = edges where the error changes."""
    usable, box = train.finite, train.domain
    measured = usable.k, measure(net, usable)
    edges = choose_edges(*measured, box) if bins is None else edges_of(box, bins)
    return smooth_profile(largest_errors(net, train, edges), len(train.points), floor)
