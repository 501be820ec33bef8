"""The closed region of one activation pattern as rows, in integers and in floats rounded from them."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from parc_jax.pwa.exact import ExactNetwork


class Halfspaces(NamedTuple):
    """{x : a.x + c <= 0 for every row (a, c)}. Rows with a = 0 hold everywhere and are left out.

    exact: (m, n + 1) integers, each row up to a positive factor. unit: (m, n + 1) the same, |a| = 1, to a few
    roundings.
    label: (m,) hidden neuron, or -1 - (domain row).
    """

    exact: np.ndarray
    unit: np.ndarray
    label: np.ndarray


def halfspaces(network: ExactNetwork, on: np.ndarray) -> Halfspaces:
    """Rows of the domain, then of every hidden neuron, for the pattern `on` (n_hidden,) bool."""
    tables, n = [network.rows], network.n
    for layer, (first, last) in enumerate(pairwise(network.first_neuron)):
        sign = np.where(on[first:last], -1, 1)  # active: the pre-activation is >= 0
        tables.append(network.forms(layer, on) * sign.astype(object)[:, None])
    exact = np.concatenate(tables)
    label = np.concatenate([-1 - np.arange(len(network.rows)), np.arange(len(on))])
    moves = np.array([any(row[:n]) for row in exact], dtype=bool)
    exact, label = exact[moves], label[moves]
    rounded = np.array([[v / max(map(abs, row[:n])) for v in row] for row in exact.tolist()])
    unit = rounded / np.linalg.norm(rounded[:, :n], axis=1, keepdims=True)
    return Halfspaces(exact, unit, label)


def same_direction(rows: Halfspaces, i: int) -> np.ndarray:
    """Rows that are exact positive multiples of row i, itself included: (m,) bool."""
    near = rows.unit @ rows.unit[i] > (1 - 1e-9) * np.linalg.norm(rows.unit, axis=1) * np.linalg.norm(rows.unit[i])
    for j in np.flatnonzero(near):
        near[j] = j == i or proportional(rows.exact[i], rows.exact[j])
    return near


def proportional(p, q) -> bool:
    """q = c p for a rational c, zero included; p is not zero."""
    at = next(k for k, v in enumerate(p) if v)
    return all(x * q[at] == y * p[at] for x, y in zip(p, q, strict=True))
