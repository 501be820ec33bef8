"""The exact signs of a finished complex, looked at again: a forward pass at the final vertices, from the weights."""

import numpy as np

from parc_jax.errors import SoundnessError
from parc_jax.pwa.bits import unpack
from parc_jax.pwa.rounding import SAFETY, TINY, U

CHUNK = 1 << 12  # vertices treated at once, so that the working set stays in cache


def recheck_signs(net, points, point_error, plus, minus, first: int) -> None:
    """Raise SoundnessError if a recorded sign contradicts the network.

    points, point_error: (V, n) vertices and bounds on their distance to the exact ones. plus, minus: (V, words) bits,
    the neurons from column `first` on; where neither is set the pre-activation is said to be 0. Forward error as in
    T10.
    """
    n_columns = first + sum(net.hidden)
    for start in range(0, len(points), CHUNK):
        rows = slice(start, start + CHUNK)
        signs = (unpack(words[rows], n_columns)[:, first:] for words in (plus, minus))
        _recheck_chunk(net, points[rows], point_error[rows], *signs)


def _recheck_chunk(net, points, point_error, plus, minus) -> None:
    h, error, gradient, first = points, np.zeros(net.n_in), np.eye(net.n_in), 0
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        size, last = np.abs(W), first + len(b)
        z = h @ W.T + b
        largest = np.abs(h).max(axis=0)
        error = (size @ error + (W.shape[1] + 4) * U * (size @ largest + np.abs(b)) + TINY) * SAFETY
        gradient = size @ gradient * SAFETY
        room = point_error @ (gradient.T * SAFETY) + error
        wrong = ((z > room) & ~plus[:, first:last]) | ((z < -room) & ~minus[:, first:last])
        if wrong.any():
            vertex, neuron = np.argwhere(wrong)[0]
            raise SoundnessError(
                f"region table: the sign of neuron {first + neuron} at vertex {points[vertex]} is recorded wrongly "
                f"({int(wrong.sum())} such). Nothing may be certified from it; please report the network."
            )
        h, first = np.maximum(z, 0.0), last
