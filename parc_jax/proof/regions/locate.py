"""Which region contains a point: its activation pattern, exactly, looked up among the patterns of
the table.

The closed region of one activation pattern as rows, in integers and in floats rounded from
them; patterns at a point and on the far side of a facet. Exact, no step size.

A pattern is defined by the signs of the pre-activations at a point that moved a little, in
the limit of a little. Layer by layer, so every form is that of the pattern it leads to.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from parc_jax.common.arrays import slices
from parc_jax.common.errors import SoundnessError
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.regions.complex import Sign
from parc_jax.proof.regions.exact import ExactNetwork
from parc_jax.proof.regions.rounding import TINY, U, forward_error
from parc_jax.proof.regions.storage import hash_words, pack


class Halfspaces(NamedTuple):
    """{x : a.x + c <= 0 for every row (a, c)}. Rows with a = 0 hold everywhere and are left out.

    exact: (m, n + 1) integers, each row up to a positive factor.
    unit: (m, n + 1) the same with |a| = 1, to a few roundings.
    label: (m,) hidden neuron, or -1 - (domain row).
    """

    exact: np.ndarray
    unit: np.ndarray
    label: np.ndarray


def halfspaces(network: ExactNetwork, on: np.ndarray) -> Halfspaces:
    """Rows of the domain, then of every hidden neuron, for the pattern `on` (n_hidden,) bool."""
    n = network.n
    tables = [network.rows]
    for layer, (first, last) in enumerate(pairwise(network.first_neuron)):
        sign = np.where(on[first:last], -1, 1)  # active: the pre-activation is >= 0
        tables.append(network.forms(layer, on) * sign.astype(object)[:, None])
    exact = np.concatenate(tables)
    label = np.concatenate([-1 - np.arange(len(network.rows)), np.arange(len(on))])
    moves = np.array([any(row[:n]) for row in exact], dtype=bool)
    exact = exact[moves]
    label = label[moves]
    rounded = np.array([[v / max(map(abs, row[:n])) for v in row] for row in exact.tolist()])
    unit = rounded / np.linalg.norm(rounded[:, :n], axis=1, keepdims=True)
    return Halfspaces(exact, unit, label)


def same_direction(rows: Halfspaces, i: int) -> np.ndarray:
    """Rows that are exact positive multiples of row i, itself included: (m,) bool."""
    length = np.linalg.norm(rows.unit, axis=1)
    near = rows.unit @ rows.unit[i] > (1 - 1e-9) * length * np.linalg.norm(rows.unit[i])
    for j in np.flatnonzero(near):
        near[j] = j == i or proportional(rows.exact[i], rows.exact[j])
    return near


def proportional(p: np.ndarray, q: np.ndarray) -> bool:
    """q = c p for a rational c, zero included; exact numbers, p is not zero."""
    at = next(k for k, v in enumerate(p) if v)
    return all(x * q[at] == y * p[at] for x, y in zip(p, q, strict=True))


def pattern_at(network: ExactNetwork, x: np.ndarray, inward: np.ndarray) -> np.ndarray:
    """Pattern (n_hidden,) of a region with interior that contains x (n,).

    inward: direction (n,) into the domain. Of several regions that meet at x, the one at x + e
    inward + e^2 e_1 + e^3 e_2 + ... for small e > 0; a neuron that is zero all over that region is
    inactive.
    """
    point, q = network.rational(x)
    moves = [network.rational(inward)[0], *np.eye(network.n, dtype=int).astype(object)]
    on = np.zeros(network.first_neuron[-1], bool)
    for layer, (first, last) in enumerate(pairwise(network.first_neuron)):
        forms = network.forms(layer, on)
        values = np.dot(forms[:, :-1], np.array(point, dtype=object)) + forms[:, -1] * q
        slopes = [np.dot(forms[:, :-1], np.array(list(move), dtype=object)) for move in moves]
        for neuron, terms in zip(
            range(first, last), zip(values, *slopes, strict=True), strict=True
        ):
            on[neuron] = next((term > 0 for term in terms if term), False)
    return on


def pattern_across(network: ExactNetwork, on: np.ndarray, rows: Halfspaces, i: int) -> np.ndarray:
    """Pattern of the region on the other side of facet row i of the region with pattern `on`.

    On generic points of the facet a neuron is zero only if its form vanishes all over the
    hyperplane. Those, and no others, change: to active where the form under the new pattern rises
    along the outward normal.
    """
    facet = rows.exact[i]
    normal = facet[:-1]
    new = on.copy()
    for layer, first in enumerate(network.first_neuron[:-1]):
        old_forms = network.forms(layer, on)
        new_forms = network.forms(layer, new)
        for neuron in np.flatnonzero(_may_vanish(network, layer, on, rows.unit[i])):
            if proportional(facet, old_forms[neuron]):
                new[first + neuron] = np.dot(new_forms[neuron][:-1], normal) > 0
    return new


def _may_vanish(
    network: ExactNetwork,
    layer: int,
    on: Bool[np.ndarray, " hidden"],
    unit: Float[np.ndarray, " columns"],
) -> np.ndarray:
    """Neurons whose form is, in floats, close to a multiple of the hyperplane (or zero)."""
    forms = network.forms(layer, on).tolist()
    size = [max(map(abs, row)) or 1 for row in forms]
    floats = np.array([[v / s for v in row] for row, s in zip(forms, size, strict=True)])
    along = np.abs(floats @ unit)
    return along >= (1 - 1e-9) * np.linalg.norm(floats, axis=1) * np.linalg.norm(unit)


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
    """Patterns (m, n_hidden) bool at k (m, n), and whether rounding cannot have changed them (m,).

    Forward error as in [T10], from the largest activations of the batch.
    """
    h = k
    error = np.zeros(net.n_in)
    on = []
    sure = np.ones(len(k), bool)
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        z = h @ W.T + b
        error = forward_error(W, b, error, np.abs(h).max(axis=0, initial=0.0))
        sure &= ((np.abs(z) > error) | (error == 0)).all(axis=1)
        on.append(z > 0)
        h = np.maximum(z, 0.0)
    return np.concatenate(on, axis=1) if on else np.zeros((len(k), 0), bool), sure


def inside_domain(domain: Box | HPolytope, k: np.ndarray) -> np.ndarray:
    """Closed membership (m,) of k (m, n), exact."""
    if isinstance(domain, Box):
        return domain.contains(k)
    A = domain.A
    b = domain.b
    excess = k @ A.T - b
    error = (domain.n + 4) * U * (np.abs(k) @ np.abs(A).T + np.abs(b)) + TINY
    outside = (excess > error).any(axis=1)
    inside = (excess < -error).all(axis=1)
    exact = ExactNetwork(A, b, [], [])
    for i in np.flatnonzero(~(outside | inside)):
        values, _ = exact.row_values(*exact.rational(k[i]), 0)
        outside[i] = any(v > 0 for v in values)
    return ~outside
