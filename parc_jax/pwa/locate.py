"""Which region contains a point: its activation pattern, exactly, looked up among the patterns of the table."""

import numpy as np

from parc_jax.errors import SoundnessError
from parc_jax.pwa.exact import ExactNetwork
from parc_jax.pwa.rounding import TINY, U
from parc_jax.sets.box import Box
from parc_jax.sets.hpolytope import HPolytope


class PatternIndex:
    """Lookup by pattern. Built once per table."""

    def __init__(self, net, patterns: np.ndarray):
        self.net, self.patterns = net, patterns
        self._factors = np.random.default_rng(0).integers(1, 2**63, patterns.shape[1], dtype=np.uint64)
        keys = self._keys(patterns)
        self._order = np.argsort(keys, kind="stable")
        self._sorted = keys[self._order]

    def find(self, k: np.ndarray) -> np.ndarray:
        """Region number (m,) of points k (m, n) inside the domain."""
        on, sure = float_patterns(self.net, k)
        at = np.searchsorted(self._sorted, self._keys(on))
        number = self._order[np.minimum(at, len(self._order) - 1)]
        # an undecided sign, or a hash collision: the slow way
        slow = np.flatnonzero(~(sure & (self.patterns[number] == on).all(axis=1)))
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

    def _keys(self, patterns: np.ndarray) -> np.ndarray:
        # sum of random 64-bit words over the active neurons, modulo 2^64
        return patterns.astype(np.uint64) @ self._factors


def float_patterns(net, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Patterns (m, n_hidden) bool at k (m, n), and whether rounding cannot have changed them (m,) (T10)."""
    h, error, on = k, np.zeros_like(k), []
    sure = np.ones(len(k), bool)
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        z, size = h @ W.T + b, np.abs(W).T
        error = (error @ size + (W.shape[1] + 4) * U * (np.abs(h) @ size + np.abs(b))) * (1 + 1e-6) + TINY * size.any(
            axis=0
        )
        sure &= ((np.abs(z) > error) | ((z == 0) & (error == 0))).all(axis=1)
        on.append(z > 0)
        h, error = np.maximum(z, 0.0), error
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
