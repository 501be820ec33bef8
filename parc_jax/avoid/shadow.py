"""The published avoid sets without LPs: polygons in the workspace, through support functions.

B_s = O~ + (-c_s(R)), so conv(B_t u B_{t+1}) = O~ + Q_t with Q_t the hull of -c_t(v), -c_{t+1}(v) over the vertices v of
R [T13 iii]. In the plane the sum is described exactly by its supports along the normals of O~ and of Q_t, and a support
of a sum is the sum of supports: no set is ever built, and no LP solved.
"""

import jax
import jax.numpy as jnp
import numpy as np
from flax import struct

from parc_jax.arrays import x64
from parc_jax.avoid.gift_wrap import hull_normals
from parc_jax.avoid.grown_polytopes import GrownPolytopes
from parc_jax.reach.pieces import Piece
from parc_jax.tolerances import TOLERANCES

_UNIT = 2.0**-53
_OPERATIONS = 64  # more than any number computed here goes through


@struct.dataclass
class Shadows:
    """Lambda_P of r pieces, T intervals and o obstacles: {p0 : edge.p0 <= edge_reach and facet.p0 <= facet_reach}.

    edge: (r, T, m, 2), largest entry 1 or zero; edge_reach: (r, T, o, m). facet: (o, h, 2), facet_reach: (r, T, o, h).
    slack: (r,) [m] covers the rounding of all of it: outside means beyond a reach by more than the slack.
    """

    edge: np.ndarray
    edge_reach: np.ndarray
    facet: np.ndarray
    facet_reach: np.ndarray
    slack: np.ndarray


def shadow(offsets, error, facet_b, facet, corners):
    """One piece. Pure kernel.

    offsets: (T + 1, v, 2) of its vertices at the knots. error: (T, 2). facet_b: (T, o, h). facet: (o, h, 2).
    corners: (o, m, 2) of obstacle + (-body). Returns edge (T, 2v, 2), edge_reach (T, o, 2v), facet_reach (T, o, h).
    """
    points = -jnp.concatenate([offsets[:-1], offsets[1:]], axis=1)
    edge = jax.vmap(hull_normals)(points)
    size = jnp.max(jnp.abs(edge), axis=2, keepdims=True)
    edge = edge / jnp.where(size > 0, size, 1)
    swept = _reach(edge, points[:, None]) + (jnp.abs(edge) * error[:, None]).sum(axis=2)  # (T, 2v)
    grown = _reach(edge[:, None], corners[None, :, None])  # (T, o, 2v)
    along = _reach(facet[None], points[:, None, None])  # (T, o, h)
    return edge, grown + swept[:, None], facet_b + along


def shadows(pieces: list[Piece], grown: GrownPolytopes) -> Shadows:
    """Lambda_P of many pieces for all intervals and obstacles, one compiled call. Exact up to `slack`."""
    offsets, slack = _offsets(pieces, grown)
    bins = np.array([piece.bin for piece in pieces])
    arrays = (offsets, grown.error[bins], grown.b[bins])
    with x64():
        parts = _shadows(*map(jnp.asarray, arrays), jnp.asarray(grown.A), jnp.asarray(grown.corners))
        edge, edge_reach, facet_reach = (np.asarray(part) for part in parts)
    return Shadows(edge, edge_reach, grown.A, facet_reach, slack)


def margins(sh: Shadows, p0: np.ndarray) -> np.ndarray:
    """How far starts p0 (r, s, 2) of each piece lie beyond Lambda_P: (r, s, T, o) [m, along a w with largest entry <= 1].

    Positive outside, negative inside, up to `slack` and the rounding of p0.
    """
    with x64():
        arrays = (p0, sh.edge, sh.edge_reach, sh.facet_reach)
        return np.asarray(_margins(*map(jnp.asarray, arrays), jnp.asarray(sh.facet)))


def outside(sh: Shadows, p0: np.ndarray) -> np.ndarray:
    """Which starts p0 (r, s, 2) of each piece are proved outside Lambda_P: (r, s, T, o). False: inside or too close."""
    slack = sh.slack[:, None] + _OPERATIONS * _UNIT * np.abs(p0).sum(axis=2)
    return margins(sh, p0) > slack[:, :, None, None]


def clear_of_reach(sh: Shadows, lo: np.ndarray, hi: np.ndarray) -> np.ndarray:
    """Which Lambda_P miss a box of starts, lo and hi (r, 2), altogether: (r, T, o). The pruning of empty avoid sets."""
    low_edge = _lowest(sh.edge, lo[:, None, None], hi[:, None, None])  # (r, T, m)
    low_facet = _lowest(sh.facet[None], lo[:, None, None], hi[:, None, None])  # (r, o, h)
    slack = sh.slack + 8 * _UNIT * np.maximum(np.abs(lo), np.abs(hi)).sum(axis=1)
    beyond_edge = (low_edge[:, :, None] - sh.edge_reach).max(axis=3, initial=-np.inf)
    beyond_facet = (low_facet[:, None] - sh.facet_reach).max(axis=3, initial=-np.inf)
    return np.maximum(beyond_edge, beyond_facet) > slack[:, None, None]


def _offsets(pieces: list[Piece], grown: GrownPolytopes) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (r, T + 1, v, 2) of the vertices, the last one repeated to fill, and the slack (r,) of the pieces."""
    n_knots = grown.error.shape[1] + 1
    width = max(len(piece.vertices) for piece in pieces)
    offsets, slack = np.zeros((len(pieces), n_knots, width, 2)), np.zeros(len(pieces))
    scene = np.abs(grown.corners).max(initial=0.0) + np.abs(grown.error).max(initial=0.0)
    for i, piece in enumerate(pieces):
        C, d = piece.C[: 2 * (n_knots - 1)], piece.d[: 2 * (n_knots - 1)]
        reached = piece.vertices @ C.T + d
        offsets[i, 1:, : len(reached)] = reached.reshape(len(reached), n_knots - 1, 2).transpose(1, 0, 2)
        offsets[i, :, len(reached) :] = offsets[i, :, len(reached) - 1 : len(reached)]
        reach = np.maximum(np.abs(piece.lo), np.abs(piece.hi))
        size = float((np.abs(C) @ reach + np.abs(d)).max(initial=0.0))
        # Vertices are floats: the piece may reach further by vertex_relative, and its image by C times that.
        moved = TOLERANCES.vertex_relative * float((np.abs(C) @ reach).max(initial=0.0))
        slack[i] = 2 * moved + 4 * _OPERATIONS * _UNIT * (size + scene)
    return offsets, slack


def _margin(p0, edge, edge_reach, facet_reach, facet):
    """One piece, one start (2,): (T, o)."""
    beyond_edge = (edge[..., 0] * p0[0] + edge[..., 1] * p0[1])[:, None] - edge_reach
    beyond_facet = (facet[..., 0] * p0[0] + facet[..., 1] * p0[1])[None] - facet_reach
    return jnp.maximum(beyond_edge.max(axis=2), beyond_facet.max(axis=2))


def _reach(w, points):
    """Supports of points (..., v, 2) along w (..., d, 2): (..., d), with the leading axes broadcast."""
    return (w[..., :, None, 0] * points[..., 0] + w[..., :, None, 1] * points[..., 1]).max(axis=-1)


def _lowest(w, lo, hi):
    """Least w.x over a box."""
    return np.minimum(w * lo, w * hi).sum(axis=-1)


_shadows = jax.jit(jax.vmap(shadow, in_axes=(0, 0, 0, None, None)))
_margins = jax.jit(jax.vmap(jax.vmap(_margin, in_axes=(0, None, None, None, None)), in_axes=(0, 0, 0, 0, None)))
