"""How far a float pre-activation at a float vertex can be from the exact one at the exact vertex.

For a vertex v of the complex with float image v^, neuron i with stored value z^_i, and every cell C at v with affine map
L_i^C, the subdivision keeps three facts (u = 2^-53):

(1) |z^_i - L_i^C(v^)| <= eta_i, one number per neuron for all vertices: forward error of the layer (T10) from the eta of
    the layer before, plus 6u per interpolation along an edge for the value and for the point. A neuron of sign 0 counts
    as z^ = 0. Interpolations form chains no longer than the number of hyperplanes cut so far.
(2) |grad L_i^C| <= lip_i in every cell.
(3) |v^ - v| <= rho(v); a face of dimension d lies within radius(face) of its exact affine hull.

So sign(z_i(v)) is the sign of z^_i whenever |z^_i| > eta_i + lip_i rho(v). New faces: hull(F0) = hull(F) and {L_p = 0}, so
radius(F0) <= r + (eta_p + lip_p r) / slope + delta with r = radius(F), slope <= |grad of L_p along F|, which the ends of
any cut edge of F bound from below; rho of a new vertex is the same formula on its edge.
"""

import numpy as np

U = 2.0**-53  # unit roundoff
PER_STEP = 6 * U  # rounding of a + t (b - a), relative to the larger end, with t a float
SAFETY = 1 + 2.0**-20  # covers the rounding of the bounds themselves
TINY = 2.0**-1000  # underflow of products


class LayerBound:
    """Error constants of one layer. Every array is (w,), one entry per neuron.

    eta: (1). lip: (2), Euclidean. grad: (w, n) entrywise bound on the gradient. eta_norm, lip_norm: bounds on the
    Euclidean norm of the whole layer's error vector and on the spectral norm of its Jacobian (tighter in deep networks).
    """

    def __init__(self, eta, eta_norm, lip, lip_norm, grad):
        self.eta, self.eta_norm, self.lip, self.lip_norm, self.grad = eta, eta_norm, lip, lip_norm, grad


def input_bound(n: int) -> LayerBound:
    """The inputs themselves: exact floats with unit gradients."""
    return LayerBound(np.zeros(n), 0.0, np.ones(n), 1.0, np.eye(n))


def layer_bound(W, b, before: LayerBound, h_max, z_max, n_cuts: int, x_max: float) -> LayerBound:
    """Constants of a layer z = W h + b.

    h_max (in,), z_max (w,): largest |h^|, |z^| over the vertices. n_cuts: hyperplanes cut in the whole run, a bound on
    the length of interpolation chains. x_max: largest |coordinate|.
    """
    n, size = before.grad.shape[1], np.abs(W)
    norms, spectral = np.linalg.norm(W, axis=1), np.linalg.norm(W, 2) if W.size else 0.0
    grad = size @ before.grad * SAFETY
    lip = np.minimum(np.linalg.norm(grad, axis=1), norms * before.lip_norm) * SAFETY
    lip_norm = min(float(np.linalg.norm(lip)), float(spectral) * before.lip_norm) * SAFETY
    forward = (W.shape[1] + 4) * U * (size @ h_max + np.abs(b))
    chains = len(b) * PER_STEP * z_max + lip * point_rounding(n, n_cuts, x_max)
    local = (forward + chains) * SAFETY + TINY * (size.sum(axis=1) > 0)
    eta = (np.minimum(size @ before.eta, norms * before.eta_norm) + local) * SAFETY
    eta_norm = min(float(np.linalg.norm(eta)), float(spectral * before.eta_norm + np.linalg.norm(local))) * SAFETY
    return LayerBound(eta, eta_norm, lip, lip_norm, grad)


def point_rounding(n: int, n_cuts: int, x_max: float) -> float:
    """delta: Euclidean rounding of a vertex after any chain of interpolations, relative to the hulls it started on."""
    return (n_cuts + 2) * PER_STEP * np.sqrt(n) * x_max
