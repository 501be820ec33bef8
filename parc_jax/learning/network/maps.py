"""Affine maps of a network on regions of its activation patterns. Float64, rounding as in [T10].

The recursion z = W h + b, h = z where active, of many patterns at once, in chunks. (In integers:
`exact.forms`.)
"""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Bool, Int

from parc_jax.common.arrays import slices
from parc_jax.learning.network.relu import ReLUNetwork

CHUNK_BYTES = 8 << 20  # working set of one chunk of regions


def pattern_map(net: ReLUNetwork, pattern: Bool[np.ndarray, " hidden"]):
    """Region rows A (n_hidden, n), b (n_hidden,) and map C (n_out, n), d (n_out,) of one activation
    pattern (n_hidden,) bool: the region is {x : A x <= b}, the network C x + d on it.
    """
    z = [forms[:, 0] for forms, _ in _hidden_maps(net, pattern[None])]
    rows = np.concatenate([np.zeros((0, net.n_in + 1)), *z])
    rows = np.where(pattern, -1.0, 1.0)[:, None] * rows
    C, d = affine_maps(net, pattern[None])
    return rows[:, :-1], -rows[:, -1], C[0], d[0]


def affine_maps(net: ReLUNetwork, patterns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """C (r, n_out, n), d (r, n_out): net(x) = C x + d on regions of patterns (r, n_hidden) bool."""
    r, n = len(patterns), net.n_in
    # filled in order by one product per chunk; C and d are views of it
    joint = np.empty((r, n + 1, net.n_out))
    for rows in _chunks(net, r):
        h = _inputs(n, len(patterns[rows]))
        for _, active in _hidden_maps(net, patterns[rows]):
            h = active
        flat = joint[rows].reshape(-1, net.n_out)
        np.matmul(h.reshape(len(h), -1).T, net.weights[-1].T, out=flat)
    joint[:, n] += net.biases[-1]
    return joint[:, :n].transpose(0, 2, 1), joint[:, n]


def facet_rows(
    net: ReLUNetwork,
    patterns: Bool[np.ndarray, "r hidden"],
    label: Int[np.ndarray, " f"],
    region: Int[np.ndarray, " f"],
) -> np.ndarray:
    """Rows (f, n + 1) of the hyperplanes of hidden neurons, under the patterns of given regions.

    label, region: (f,). Scaled by a power of two to a largest gradient entry in [1/2, 1), so
    neurons of any scale give rows of one scale.
    """
    out = np.empty((len(label), net.n_in + 1))
    order = np.lexsort((label, region))
    sorted_region = region[order]
    for rows in _chunks(net, len(patterns)):
        inside = order[slice(*np.searchsorted(sorted_region, (rows.start, rows.stop)))]
        first = 0
        for z, _ in _hidden_maps(net, patterns[rows]):
            here = inside[(label[inside] >= first) & (label[inside] < first + len(z))]
            out[here] = z[label[here] - first, region[here] - rows.start]
            first += len(z)
    _, exponent = np.frexp(np.abs(out[:, :-1]).max(axis=1, initial=0.0))
    return np.ldexp(out, -exponent[:, None])


def last_gradients(weights: Sequence[np.ndarray], patterns: np.ndarray) -> np.ndarray:
    """Gradients (w, r, n) of the last of these layers' pre-activations on each region.

    patterns: (r, neurons of the layers before) bool.
    """
    table = np.repeat(weights[0][:, None], len(patterns), axis=1)
    first = 0
    for W in weights[1:]:
        last = first + len(table)
        table *= patterns[:, first:last].T[:, :, None]
        table = (W @ table.reshape(len(table), -1)).reshape(len(W), *table.shape[1:])
        first = last
    return table


def _hidden_maps(net: ReLUNetwork, patterns: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Per hidden layer: (width, r, n + 1) maps of the pre-activations and of the activations under
    each pattern; the last axis holds the gradient, then the constant.
    """
    r = len(patterns)
    n = net.n_in
    h = _inputs(n, r)
    first = 0
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        last = first + len(b)
        z = (W @ h.reshape(len(h), -1)).reshape(len(b), r, n + 1)
        z[:, :, n] += b[:, None]
        h = z * patterns[:, first:last].T[:, :, None]
        yield z, h
        first = last


def _inputs(n: int, r: int) -> np.ndarray:
    """(n, r, n + 1) maps of the inputs themselves."""
    return np.repeat(np.eye(n, n + 1)[:, None], r, axis=1)


def _chunks(net: ReLUNetwork, r: int) -> Iterator[slice]:
    """Ranges of regions whose maps of one layer fit into CHUNK_BYTES."""
    width = max(len(b) for b in net.biases)
    return slices(r, max(1, CHUNK_BYTES // (8 * width * (net.n_in + 1))))
