"""Which region contains a point: its activation pattern, exactly, looked up among the patterns of the table."""

import numpy as np

from parc_jax.errors import SoundnessError
from parc_jax.pwa.bits import hash_words, pack
from parc_jax.pwa.exact import ExactNetwork
from parc_jax.pwa.rounding import SAFETY, TINY, U
from parc_jax.sets.box import Box
from parc_jax.sets.hpolytope import HPolytope

CHUNK = 1 << 13  # points treated at once, so that the working set stays in cache


class PatternIndex:
    """Lookup by pattern. Built once per table."""

    def __init__(self, net, patterns: np.ndarray):
        self.net, self.patterns = net, patterns
        self._words = pack(patterns)
        keys = hash_words(self._words)
        self._order = np.argsort(keys, kind="stable")
        self._sorted = keys[self._order]

    def find(self, k: np.ndarray) -> np.ndarray:
        """Region number (m,) of points k (m, n) inside the domain."""
        number = np.empty(len(k), int)
        for start in range(0, len(k), CHUNK):
            number[start : start + CHUNK] = self._find_chunk(k[start : start + CHUNK])
        return number

    def _find_chunk(self, k: np.ndarray) -> np.ndarray:
        on, sure = float_patterns(self.net, k)
        words = pack(on)
        at = np.searchsorted(self._sorted, hash_words(words))
        number = self._order[np.minimum(at, len(self._order) - 1)]
        # an undecided sign, or a hash collision: the slow way
        slow = np.flatnonzero(~(sure & (self._words[number] == words).all(axis=1)))
        if len(slow):
            exact = ExactNetwork(np.zeros((0, k.shape[1])), np.zeros(0), self.net.weights[:-1], self.net.biases[:-1])
            for i in slow:
                number[i] = self._closed_region(exact.codes(k[i]), k[i])
        return number

    def _closed_region(self, codes: np.ndarray, k: np.ndarray) -> int:
        """A region whose pattern agrees with all nonzero signs at k; its closure contains k."""
        nonzero = codes != 0
        fits = np.flatnonzero((self.patterns[:, nonzero] == (codes[nonzero] == 1)).all(axis=1))
        if not len(fits):
            raise SoundnessError(f"locate: no region contains {k}; the table is incomplete. Please report the network.")
        return int(fits[0])


def float_patterns(net, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Patterns (m, n_hidden) bool at k (m, n), and whether rounding cannot have changed them (m,).

    Forward error as in T10, from the largest activations of the batch.
    """
    h, error, on = k, np.zeros(net.n_in), []
    sure = np.ones(len(k), bool)
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        size, z = np.abs(W), h @ W.T + b
        largest = np.abs(h).max(axis=0, initial=0.0)
        error = (size @ error + (W.shape[1] + 4) * U * (size @ largest + np.abs(b)) + TINY * size.any(axis=1)) * SAFETY
        sure &= ((np.abs(z) > error) | (error == 0)).all(axis=1)
        on.append(z > 0)
        h = np.maximum(z, 0.0)
    return np.concatenate(on, axis=1) if on else np.zeros((len(k), 0), bool), sure


def inside_domain(domain: Box | HPolytope, k: np.ndarray) -> np.ndarray:
    """Closed membership (m,) of k (m, n), exact."""
    if isinstance(domain, Box):
        return domain.contains(k)
    A, b = domain.A, domain.b
    excess = k @ A.T - b
    error = (domain.n + 4) * U * (np.abs(k) @ np.abs(A).T + np.abs(b)) + TINY
    outside, sure = (excess > error).any(axis=1), (excess < -error).all(axis=1)
    exact = ExactNetwork(A, b, [], [])
    for i in np.flatnonzero(~(outside | sure)):
        outside[i] = any(v > 0 for v in exact.row_values(*exact.rational(k[i]), 0)[0])
    return ~outside
