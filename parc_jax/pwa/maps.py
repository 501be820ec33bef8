"""Affine maps of activation patterns: what the network is on each region. Float64; rounding as in T10."""

from collections.abc import Iterator

import numpy as np

CHUNK_BYTES = 64 << 20  # working set of one chunk of regions


def affine_maps(net, patterns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """C (r, n_out, n), d (r, n_out) with net(x) = C x + d on the region of each pattern (r, n_hidden) bool."""
    r, n = len(patterns), net.n_in
    C, d = np.empty((r, net.n_out, n)), np.empty((r, net.n_out))
    for rows in _chunks(net, r):
        *_, table = preactivation_maps(net, patterns[rows])
        C[rows] = table[:, :, :n].transpose(1, 0, 2)
        d[rows] = table[:, :, n].T
    return C, d


def preactivation_maps(net, patterns: np.ndarray) -> Iterator[np.ndarray]:
    """Per layer, outputs last: (width, r, n + 1), gradient then constant of every pre-activation under each pattern."""
    r, n = len(patterns), net.n_in
    table = np.zeros((n, r, n + 1))
    table[np.arange(n), :, np.arange(n)] = 1.0
    first = 0
    for W, b in zip(net.weights, net.biases, strict=True):
        width = len(b)
        table = (W @ table.reshape(len(table), -1)).reshape(width, r, n + 1)
        table[:, :, n] += b[:, None]
        yield table
        table = table * patterns[:, first : first + width].T[:, :, None] if first < patterns.shape[1] else table
        first += width


def facet_rows(net, patterns, label, region) -> np.ndarray:
    """Rows (f, n + 1) of the hyperplanes of hidden neurons `label` (f,), under the patterns of the regions `region`
    (f,).

    Scaled by a power of two to a largest gradient entry in [1/2, 1), so neurons of any scale give rows of one scale.
    """
    out = np.empty((len(label), net.n_in + 1))
    order = np.argsort(region, kind="stable")
    sorted_region = region[order]
    for rows in _chunks(net, len(patterns)):
        mine = order[slice(*np.searchsorted(sorted_region, (rows.start, rows.stop)))]
        first = 0
        for table in preactivation_maps(net, patterns[rows]):
            here = mine[(label[mine] >= first) & (label[mine] < first + len(table))]
            out[here] = table[label[here] - first, region[here] - rows.start]
            first += len(table)
            if first >= patterns.shape[1]:
                break
    _, exponent = np.frexp(np.abs(out[:, :-1]).max(axis=1, initial=0.0))
    return np.ldexp(out, -exponent[:, None])


def _chunks(net, r: int) -> Iterator[slice]:
    width = max(len(b) for b in net.biases)
    step = max(1, CHUNK_BYTES // (8 * width * (net.n_in + 1)))
    return (slice(i, min(i + step, r)) for i in range(0, r, step))
