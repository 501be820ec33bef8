"""Where the reference points can be at all, whatever safe plan is driven: a box per knot around all
predicted places. [T11, T14]

A plan that counts ends in the goal, so it is known up to the goal's box where its first point ends,
and interval arithmetic over small boxes of K bounds all other places against that end. Each bound
is as wide as rounding may make it: `Scene.slack` covers every sum of the network's outputs.
"""

from typing import NamedTuple

import numpy as np

from parc_jax.common.sets.box import Box
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import Layout
from parc_jax.learning.network.relu import ReLUNetwork

BOXES = 1024  # about so many boxes of K, alike along all axes


class Ways(NamedTuple):
    """Bounds on the places of all points before the end: lo, hi (T + 1, n_c) [m], counted from
    where the first point ends."""

    lo: np.ndarray
    hi: np.ndarray


def ways_of(model: TrajectoryModel) -> Ways:
    """Bounds on the ways of all plans with k in K, up to the rounding of the network."""
    net, layout, domain = model.net, model.layout, model.domain
    lo, hi = _small_boxes(domain)
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        lo, hi = (np.maximum(x, 0.0) for x in _affine(W, b, lo, hi))
    W, b = _from_the_end(net, layout)
    lo, hi = _affine(W, b, lo, hi)
    shape = (layout.n_steps + 1, layout.n_c)
    return Ways(lo.min(axis=0).reshape(shape), hi.max(axis=0).reshape(shape))


def _from_the_end(net: ReLUNetwork, layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """The last layer's rows of all places, less those of the end of the first point."""
    n_p, split = layout.n_p, layout.n_offsets
    W, b = net.weights[-1][:split], net.biases[-1][:split]
    W = np.concatenate([np.zeros((n_p, W.shape[1])), W])
    b = np.concatenate([np.zeros(n_p), b])
    end = layout.n_steps * layout.n_c + np.tile(np.arange(n_p), len(b) // n_p)
    return W - W[end], b - b[end]


def _affine(W: np.ndarray, b: np.ndarray, lo: np.ndarray, hi: np.ndarray):
    """Bounds on W x + b over boxes of x, lo and hi (s, n)."""
    up, down = np.maximum(W, 0.0).T, np.minimum(W, 0.0).T
    return lo @ up + hi @ down + b, hi @ up + lo @ down + b


def _small_boxes(domain: Box) -> tuple[np.ndarray, np.ndarray]:
    """Boxes lo, hi (s, n_k) that fill the domain; neighbours share their border."""
    each = max(1, int(BOXES ** (1 / domain.n)))
    edges = [np.linspace(lo, hi, each + 1) for lo, hi in zip(domain.lo, domain.hi, strict=True)]
    for edge, lo, hi in zip(edges, domain.lo, domain.hi, strict=True):
        edge[0] = lo
        edge[-1] = hi
    corner = [np.meshgrid(*(e[s] for e in edges), indexing="ij") for s in (np.s_[:-1], np.s_[1:])]
    lo, hi = (np.stack(c, axis=-1).reshape(-1, domain.n) for c in corner)
    return lo, hi
