"""How far a float pre-activation at a float vertex can be from the exact one at the exact vertex.

For a vertex v of the complex with float image v^, neuron i with stored value z^_i, and every cell C
at v with affine map L_i^C, the subdivision maintains three facts (u = 2^-53):

(1) |z^_i - L_i^C(v^)| <= eta_i, one number per neuron for all vertices: forward error of the layer
    [T10] from the eta of the layer before, plus 6u per interpolation along an edge for the value
    and for the point. A neuron of sign 0 counts as z^ = 0. Interpolations form chains no longer
    than the number of hyperplanes cut so far.
(2) |grad L_i^C| <= lip_i in every cell.
(3) |v^ - v| <= rho(v); a face of dimension d lies within radius(face) of its exact affine hull.

So sign(z_i(v)) is the sign of z^_i whenever |z^_i| > eta_i + lip_i rho(v). New faces: hull(F0) =
hull(F) and {L_p = 0}, so radius(F0) <= r + (eta_p + lip_p r) / slope + delta with r = radius(F),
slope <= |grad of L_p along F|, which the ends of any cut edge of F bound from below; rho of a new
vertex is the same formula on its edge.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from parc_jax.common.arrays import slices
from parc_jax.learning.network.maps import last_gradients
from parc_jax.learning.network.relu import ReLUNetwork

U = 2.0**-53  # unit roundoff
PER_STEP = 6 * U  # rounding of a + t (b - a), relative to the larger end, with t a float
SAFETY = 1 + 2.0**-20  # covers the rounding of the bounds themselves
CHUNK_BYTES = 64 << 20  # working set of one chunk of cells
TINY = 2.0**-1000  # underflow of products


class LayerBound(NamedTuple):
    """Error constants of one layer.

    eta, lip (w,): (1) and (2). eta_norm: bound on the Euclidean norm of the errors of all neurons
    at one vertex, often sharper than that of eta in deep networks.
    """

    eta: np.ndarray
    eta_norm: float
    lip: np.ndarray


def cell_gradients(weights: Sequence[np.ndarray], patterns: np.ndarray) -> np.ndarray:
    """Euclidean norms (cells, w) of gradients of the last of these layers in each cell, rounded up.

    patterns: (cells, neurons of the layers before) bool.
    """
    n = weights[0].shape[1]
    size = np.abs(weights[0])
    for later in weights[1:]:
        size = np.abs(later) @ size
    rounding = sum(4 + later.shape[1] for later in weights) * U * SAFETY * size
    norms = np.empty((len(patterns), len(weights[-1])))
    together = max(1, CHUNK_BYTES // (8 * n * max(len(later) for later in weights)))
    for cells in slices(len(patterns), together):
        table = last_gradients(weights, patterns[cells])
        np.abs(table, out=table)
        table += rounding[:, None]
        norms[cells] = np.sqrt((table * table).sum(axis=2)).T * SAFETY
    return norms


def forward(net: ReLUNetwork, x: Float[np.ndarray, "m n"]) -> Iterator[tuple[np.ndarray, ...]]:
    """Of each hidden layer the weights W, float pre-activations (m, w) at points x, and their error
    (w,), from the largest activations of all points. [T10]
    """
    error = np.zeros(net.n_in)
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        size, largest = np.abs(W), np.abs(x).max(axis=0, initial=0.0)
        rounding = (W.shape[1] + 4) * U * (size @ largest + np.abs(b))
        error = (size @ error + rounding + TINY * size.any(axis=1)) * SAFETY
        z = x @ W.T + b
        yield W, z, error
        x = np.maximum(z, 0.0)


def layer_bound(
    W: Float[np.ndarray, "w inputs"],
    b: Float[np.ndarray, " w"],
    before: LayerBound,
    lip: Float[np.ndarray, " w"],
    h_max: Float[np.ndarray, " inputs"],
    z_max: Float[np.ndarray, " w"],
    delta: float,
) -> LayerBound:
    """Constants of a layer z = W h + b.

    lip (w,): bounds on the Euclidean gradients over all cells.
    h_max (in,), z_max (w,): largest |h^|, |z^| over the vertices. delta: `point_rounding`.
    """
    size = np.abs(W)
    norms = np.linalg.norm(W, axis=1)
    spectral = np.linalg.norm(W, 2) if W.size else 0.0
    forward = (W.shape[1] + 4) * U * (size @ h_max + np.abs(b))
    chains = len(b) * PER_STEP * z_max + lip * delta
    local = (forward + chains) * SAFETY + TINY * (size.sum(axis=1) > 0)
    eta = (np.minimum(size @ before.eta, norms * before.eta_norm) + local) * SAFETY
    through_norms = float(spectral * before.eta_norm + np.linalg.norm(local))
    eta_norm = min(float(np.linalg.norm(eta)), through_norms) * SAFETY
    return LayerBound(eta, eta_norm, lip)


def point_rounding(n: int, n_cuts: int) -> float:
    """delta: Euclidean rounding of a vertex with coordinates up to 1 after any chain of
    interpolations, relative to the hulls it started on.

    n_cuts: hyperplanes cut in all, a bound on the length of these chains.
    """
    return (n_cuts + 2) * PER_STEP * np.sqrt(n)
