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


def edge_normals(offsets):
    """Normals of Q_t for one piece. offsets: (T + 1, v, 2) of its vertices at the knots. Returns (T, 2v, 2)."""
    points = _swept(offsets)
    edge = jnp.stack(hull_normals(*jnp.moveaxis(points, (2, 1), (0, 1))), axis=2)  # (2v, T, 2)
    edge = jnp.swapaxes(edge, 0, 1)
    size = jnp.max(jnp.abs(edge), axis=2, keepdims=True)
    return edge / jnp.where(size > 0, size, 1)


def reaches(edge, offsets, error, facet_b, facet, corners):
    """Supports of Lambda_P of one piece. Pure kernel.

    edge: (T, m, 2). offsets: (T + 1, v, 2). error: (T, 2). facet_b: (T, o, h). facet: (o, h, 2). corners: (o, c, 2) of
    obstacle + (-body). Returns edge_reach (T, o, m), facet_reach (T, o, h).
    """
    points = _swept(offsets)
    swept = _reach(edge, points[:, None]) + (jnp.abs(edge) * error[:, None]).sum(axis=2)  # (T, m)
    grown = _reach(edge[:, None], corners[None, :, None])  # (T, o, m)
    knot = _reach(facet[None], -offsets[:, None, None])  # (T + 1, o, h)
    along = jnp.maximum(knot[:-1], knot[1:])
    return grown + swept[:, None], facet_b + along


def shadows(pieces: Piece, grown: GrownPolytopes) -> Shadows:
    """Lambda_P of r stacked pieces for all intervals and obstacles. Exact up to `slack`."""
    offsets, slack = _offsets(pieces, grown)
    with x64():
        on_device = jnp.asarray(offsets)
        edge, used = map(np.asarray, _edge_normals(on_device))
        edge = edge[:, :, : _even(1 + int(np.flatnonzero(used).max(initial=0)), edge.shape[2])]
        shared = jnp.asarray(grown.A), jnp.asarray(grown.corners)
        arrays = (jnp.asarray(a) for a in (edge, grown.error[pieces.bin], grown.b[pieces.bin]))
        found = _reaches(next(arrays), on_device, *arrays, *shared)
        edge_reach, facet_reach = (np.asarray(part) for part in found)
    return Shadows(edge, edge_reach, grown.A, facet_reach, slack)


def margins(sh: Shadows, p0: np.ndarray) -> np.ndarray:
    """How far starts p0 (r, s, 2) lie beyond Lambda_P of their piece: (r, s, T, o) [m along a w of size <= 1].

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
    slack = sh.slack + 8 * _UNIT * np.maximum(np.abs(lo), np.abs(hi)).sum(axis=1)
    with x64():
        arrays = (lo, hi, sh.edge, sh.edge_reach, sh.facet_reach)
        return np.asarray(_box_margins(*map(jnp.asarray, arrays), jnp.asarray(sh.facet))) > slack[:, None, None]


def _offsets(pieces: Piece, grown: GrownPolytopes) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (r, T + 1, v, 2) of the vertices at the knots, and the slack (r,) of the pieces."""
    n_steps = grown.error.shape[1]
    r, v = pieces.vertices.shape[:2]
    C, d = pieces.C[:, : 2 * n_steps], pieces.d[:, : 2 * n_steps]
    reached = C @ pieces.vertices.swapaxes(1, 2) + d[:, :, None]
    offsets = np.zeros((r, n_steps + 1, v, 2))
    offsets[:, 1:] = reached.reshape(r, n_steps, 2, v).swapaxes(2, 3)
    size = (np.abs(C) @ pieces.reach[:, :, None])[:, :, 0] + np.abs(d)
    error = np.abs(grown.error[pieces.bin]).max(axis=(1, 2), initial=0)  # the piece's own: other bins may be unclaimed
    size = size.max(axis=1) + np.abs(grown.corners).max(initial=0) + error
    # Vertices are floats: the piece may reach further by its slip, and its image by C times that.
    moved = (np.abs(C) @ pieces.slip[:, :, None]).max(axis=(1, 2))
    return offsets, 2 * moved + 4 * _OPERATIONS * _UNIT * size


def _margin(p0, edge, edge_reach, facet_reach, facet):
    """One piece, one start (2,): (T, o)."""
    beyond_edge = (edge[..., 0] * p0[0] + edge[..., 1] * p0[1])[:, None] - edge_reach
    beyond_facet = (facet[..., 0] * p0[0] + facet[..., 1] * p0[1])[None] - facet_reach
    return jnp.maximum(beyond_edge.max(axis=2), beyond_facet.max(axis=2))


def _box_margin(lo, hi, edge, edge_reach, facet_reach, facet):
    """One piece, the least margin over a box along one direction: (T, o)."""

    def lowest(w):
        return jnp.minimum(w[..., 0] * lo[0], w[..., 0] * hi[0]) + jnp.minimum(w[..., 1] * lo[1], w[..., 1] * hi[1])

    beyond_edge, beyond_facet = lowest(edge)[:, None] - edge_reach, lowest(facet)[None] - facet_reach
    return jnp.maximum(beyond_edge.max(axis=2), beyond_facet.max(axis=2))


def _swept(offsets):
    """Points of Q_t: minus the offsets at both knots of every interval, (T, 2v, 2)."""
    return -jnp.concatenate([offsets[:-1], offsets[1:]], axis=1)


def _reach(w, points):
    """Supports of points (..., v, 2) along w (..., d, 2): (..., d), with the leading axes broadcast."""
    return (w[..., :, None, 0] * points[..., 0] + w[..., :, None, 1] * points[..., 1]).max(axis=-1)


def _even(count: int, most: int) -> int:
    """Next multiple of four: few shapes compile."""
    return min(-(-count // 4) * 4, most)


@jax.jit
def _edge_normals(offsets):
    """`edge_normals` of piece after piece (the arrays of one piece stay in cache), and which of the 2v rows matter.

    Hulls have far fewer edges than points: rows that repeat the first edge in every set can go.
    """
    edge = jax.lax.map(edge_normals, offsets)
    return edge, (edge != edge[:, :, :1]).any(axis=(0, 1, 3))


_reaches = jax.jit(jax.vmap(reaches, in_axes=(0, 0, 0, 0, None, None)))
_margins = jax.jit(jax.vmap(jax.vmap(_margin, in_axes=(0, None, None, None, None)), in_axes=(0, 0, 0, 0, None)))
_box_margins = jax.jit(jax.vmap(_box_margin, in_axes=(0, 0, 0, 0, 0, None)))
