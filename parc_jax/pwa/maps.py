"""Affine maps of activation patterns: what the network is on each region. Float64; rounding as in T10."""

from collections.abc import Iterator

import numpy as np

CHUNK_BYTES = 8 << 20  # working set of one chunk of regions


def affine_maps(net, patterns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """C (r, n_out, n), d (r, n_out) with net(x) = C x + d on the region of each pattern (r, n_hidden) bool."""
    r, n, out = len(patterns), net.n_in, net.n_out
    joint = np.empty((r, n + 1, out))  # filled in order by one product per chunk; C and d are views of it
    for rows in _chunks(net, r):
        h = identity_maps(n, len(patterns[rows]))
        for layer in hidden_maps(net, patterns[rows]):
            h = layer[1]
        np.matmul(h.reshape(len(h), -1).T, net.weights[-1].T, out=joint[rows].reshape(-1, out))
    joint[:, n] += net.biases[-1]
    return joint[:, :n].transpose(0, 2, 1), joint[:, n]


def hidden_maps(net, patterns: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Per hidden layer: (width, r, n + 1) maps of the pre-activations and of the activations under each pattern.

    The last axis holds the gradient, then the constant.
    """
    r, n, first = len(patterns), net.n_in, 0
    h = identity_maps(n, r)
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        last = first + len(b)
        z = (W @ h.reshape(len(h), -1)).reshape(len(b), r, n + 1)
        z[:, :, n] += b[:, None]
        h = z * patterns[:, first:last].T[:, :, None]
        yield z, h
        first = last


def identity_maps(n: int, r: int) -> np.ndarray:
    """(n, r, n + 1) maps of the inputs themselves."""
    return np.repeat(np.eye(n, n + 1)[:, None], r, axis=1)


def facet_rows(net, patterns, label, region) -> np.ndarray:
    """Rows (f, n + 1) of the hyperplanes of hidden neurons, under the patterns of given regions.

    label, region: (f,). Scaled by a power of two to a largest gradient entry in [1/2, 1), so neurons of any scale give
    rows of one scale.
    """
    out = np.empty((len(label), net.n_in + 1))
    order = np.lexsort((label, region))
    sorted_region = region[order]
    for rows in _chunks(net, len(patterns)):
        mine = order[slice(*np.searchsorted(sorted_region, (rows.start, rows.stop)))]
        first = 0
        for z, _ in hidden_maps(net, patterns[rows]):
            here = mine[(label[mine] >= first) & (label[mine] < first + len(z))]
            out[here] = z[label[here] - first, region[here] - rows.start]
            first += len(z)
    _, exponent = np.frexp(np.abs(out[:, :-1]).max(axis=1, initial=0.0))
    return np.ldexp(out, -exponent[:, None])


def _chunks(net, r: int) -> Iterator[slice]:
    width = max(len(b) for b in net.biases)
    step = max(1, CHUNK_BYTES // (8 * width * (net.n_in + 1)))
    return (slice(i, min(i + step, r)) for i in range(0, r, step))
