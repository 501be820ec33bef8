"""A profile from training runs alone, and tubes on finer bins."""

from dataclasses import replace

import jax
import numpy as np

from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.bound.edges import choose_edges, edges_of
from parc_jax.learning.bound.profile import bin_maxima, smooth_profile, training_errors


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
    k, errors = training_errors(net, train)
    box = train.domain
    edges = choose_edges(k, errors, box, floor) if bins is None else edges_of(box, bins)
    return smooth_profile(bin_maxima(k, errors, edges), len(train.points), floor)
