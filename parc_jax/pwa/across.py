"""Activation patterns of full-dimensional regions: at a point, and on the far side of a facet. Exact, no step size.

Both ask for the signs of the pre-activations at a point that moved a little, in the limit of a little. Layer by
layer, so every form is that of the pattern it leads to.
"""

from itertools import pairwise

import numpy as np

from parc_jax.pwa.exact import ExactNetwork
from parc_jax.pwa.halfspaces import Halfspaces, proportional


def pattern_at(network: ExactNetwork, x: np.ndarray, inward: np.ndarray) -> np.ndarray:
    """Pattern (n_hidden,) of a region with interior that contains x (n,).

    inward: direction (n,) into the domain. Of several regions that meet at x, the one at x + e inward + e^2 e_1 + e^3
    e_2 + ... for small e > 0; a neuron that is zero all over that region is inactive.
    """
    point, q = network.rational(x)
    moves = [network.rational(inward)[0], *np.eye(network.n, dtype=int).astype(object)]
    on = np.zeros(network.first_neuron[-1], bool)
    for layer, (first, last) in enumerate(pairwise(network.first_neuron)):
        forms = network.forms(layer, on)
        values = np.dot(forms[:, :-1], np.array(point, dtype=object)) + forms[:, -1] * q
        signs = [values, *(np.dot(forms[:, :-1], np.array(list(move), dtype=object)) for move in moves)]
        on[first:last] = [next((s > 0 for s in column if s), False) for column in zip(*signs, strict=True)]
    return on


def pattern_across(network: ExactNetwork, on: np.ndarray, rows: Halfspaces, i: int) -> np.ndarray:
    """Pattern of the region on the other side of facet row i of the region with pattern `on`.

    On generic points of the facet a neuron is zero only if its form vanishes on the whole hyperplane. Those, and no
    others, change: to active where the form under the new pattern rises along the outward normal.
    """
    facet = rows.exact[i]
    normal = facet[:-1]
    new = on.copy()
    for layer, first in enumerate(network.first_neuron[:-1]):
        old_forms, new_forms = network.forms(layer, on), network.forms(layer, new)
        for neuron in np.flatnonzero(_may_vanish(network, layer, on, rows.unit[i])):
            if proportional(facet, old_forms[neuron]):
                new[first + neuron] = np.dot(new_forms[neuron][:-1], normal) > 0
    return new


def _may_vanish(network: ExactNetwork, layer: int, on, unit) -> np.ndarray:
    """Neurons whose form is, in floats, close to a multiple of the hyperplane (or zero)."""
    forms = network.forms(layer, on)
    size = [max(map(abs, row)) or 1 for row in forms.tolist()]
    floats = np.array([[v / s for v in row] for row, s in zip(forms.tolist(), size, strict=True)])
    along = np.abs(floats @ unit)
    return along >= (1 - 1e-9) * np.linalg.norm(floats, axis=1) * np.linalg.norm(unit)
