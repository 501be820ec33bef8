"""Which region contains a point: its exact activation pattern, looked up among the table's."""

import numpy as np

from parc_jax.common.arrays import slices
from parc_jax.common.errors import SoundnessError
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.regions.complex import Sign
from parc_jax.proof.regions.exact import ExactNetwork
from parc_jax.proof.regions.rounding import forward
from parc_jax.proof.regions.storage import hash_words, pack

CHUNK = 1 << 13  # points treated at once, so that the working set stays in cache


class PatternIndex:
    """Lookup by pattern. Built once per table."""

    def __init__(self, net: ReLUNetwork, patterns: np.ndarray):
        self.net = net
        self.patterns = patterns
        self._words = pack(patterns)
        keys = hash_words(self._words)
        self._order = np.argsort(keys, kind="stable")
        self._sorted = keys[self._order]

    def find(self, k: np.ndarray) -> np.ndarray:
        """Region number (m,) of points k (m, n) inside the domain."""
        number = np.empty(len(k), int)
        for rows in slices(len(k), CHUNK):
            number[rows] = self._find_chunk(k[rows])
        return number

    def _find_chunk(self, k: np.ndarray) -> np.ndarray:
        on, sure = float_patterns(self.net, k)
        words = pack(on)
        at = np.searchsorted(self._sorted, hash_words(words))
        number = self._order[np.minimum(at, len(self._order) - 1)]
        # an undecided sign, or a hash collision: the slow way
        slow = np.flatnonzero(~(sure & (self._words[number] == words).all(axis=1)))
        if len(slow):
            no_rows = np.zeros((0, k.shape[1]))
            hidden = (self.net.weights[:-1], self.net.biases[:-1])
            exact = ExactNetwork(no_rows, np.zeros(0), *hidden)
            for i in slow:
                number[i] = self._closed_region(exact.codes(k[i]), k[i])
        return number

    def _closed_region(self, codes: np.ndarray, k: np.ndarray) -> int:
        """A region whose pattern agrees with all nonzero signs at k; its closure contains k."""
        nonzero = codes != Sign.ZERO
        plus = codes[nonzero] == Sign.PLUS
        fits = np.flatnonzero((self.patterns[:, nonzero] == plus).all(axis=1))
        if not len(fits):
            raise SoundnessError(
                f"locate: no region contains {k}; the table is incomplete. Please report the "
                "network."
            )
        return int(fits[0])


def float_patterns(net: ReLUNetwork, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Patterns (m, n_hidden) bool at k (m, n); whether rounding cannot change them (m,). [T10]"""
    on = [np.zeros((len(k), 0), bool)]
    sure = np.ones(len(k), bool)
    for _, z, error in forward(net, k):
        sure &= ((np.abs(z) > error) | (error == 0)).all(axis=1)
        on.append(z > 0)
    return np.concatenate(on, axis=1), sure
