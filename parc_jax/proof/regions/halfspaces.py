"""The closed region of one activation pattern as rows, in integers and in floats rounded from
them; patterns at a point and on the far side of a facet. Exact, no step size.

A pattern is asked for through the signs of the pre-activations at a point that moved a little, in
the limit of a little. Layer by layer, so every form is that of the pattern it leads to.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from parc_jax.proof.regions.exact import ExactNetwork


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

    On generic points of the facet a neuron is zero only if its form vanishes on the whole
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
