"""The published avoid sets without LPs: polygons in the workspace, through support functions.

B_s = O~ + (-c_s(R)), so conv(B_t u B_{t+1}) = O~ + Q_t with Q_t the hull of -c_t(v), -c_{t+1}(v)
over the vertices v of R [T13]. In the plane the sum is described exactly by its supports along
the normals of O~ and of Q_t, and a support of a sum is the sum of supports: no set is ever built,
and no LP solved.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.neuralparc.cells import Cell
from benchmarks.neuralparc.scene import GrownPolytopes
from parc_jax.common import struct
from parc_jax.common.arrays import x64

# [extent of the set] points closer than this count as one; merging only makes the set look larger
_SAME = 1e-13


class _Walk(NamedTuple):
    """All walks, in step.

    count: edges found. x, y: (...) where they are. u, v: (...) their last edges.
    normal_x, normal_y: (m, ...). closed: (...) whether a walk has come back to its start.
    """

    count: jax.Array
    x: jax.Array
    y: jax.Array
    u: jax.Array
    v: jax.Array
    normal_x: jax.Array
    normal_y: jax.Array
    closed: jax.Array


def hull_normals(x, y):
    """Outward edge normals of the hull of m points (x, y), not scaled: a pair of arrays (m, ...).

    x, y: (m, ...), one set along axis 0, or many along trailing axes. Rows beyond the last edge
    repeat earlier ones. Gift wrapping in floats; repeated and collinear points are fine, a single
    point gives zeros. Supports along these normals describe the hull to rounding; since any
    direction gives a valid support, a poor normal can only make a set look larger, never smaller.
    """
    left = x.min(0)
    low = jnp.where(x == left[None], y, jnp.inf).min(0)
    extent = jnp.maximum(x.max(0) - left, y.max(0) - y.min(0))
    start = _Walk(
        count=jnp.int32(0),
        x=left,
        y=low,
        u=jnp.zeros_like(left),
        v=-jnp.ones_like(left),
        normal_x=jnp.zeros_like(x),
        normal_y=jnp.zeros_like(y),
        closed=jnp.zeros_like(left, dtype=bool),
    )

    def going(walk: _Walk):
        return (walk.count < x.shape[0]) & ~walk.closed.all()

    def step(walk: _Walk):
        return _next_edge(x, y, left, low, _SAME * extent, walk)

    end = jax.lax.while_loop(going, step, start)
    used = _numbers(x) < end.count
    return tuple(jnp.where(used, n, n[:1]) for n in (end.normal_x, end.normal_y))


def _next_edge(x, y, left, low, tiny, walk: _Walk) -> _Walk:
    """Turn left as little as possible; of points in the same direction take the farthest."""
    to_x, to_y = x - walk.x[None], y - walk.y[None]
    dot = to_x * walk.u[None] + to_y * walk.v[None]
    cross = walk.u[None] * to_y - walk.v[None] * to_x
    length = jnp.maximum(jnp.abs(to_x), jnp.abs(to_y))
    away = length > tiny[None]
    # Grows with the turning angle from 0 to 2 over half a turn, with full relative precision near
    # both ends.
    share = jnp.maximum(cross, 0) / jnp.where(away, jnp.abs(cross) + jnp.abs(dot), 1)
    turn = jnp.where(away, jnp.where(dot >= 0, share, 2 - share), jnp.inf)
    far = jnp.where(turn <= turn.min(0)[None], jnp.where(away, length, 0), -1)
    number = _numbers(x)
    # The first of the farthest; written as two minima because XLA does not vectorise argmax on a
    # CPU.
    chosen = number == jnp.where(far >= far.max(0)[None], number, x.shape[0]).min(0)[None]
    here_x = jnp.where(chosen, x, 0).sum(0)
    here_y = jnp.where(chosen, y, 0).sum(0)
    u, v = here_x - walk.x, here_y - walk.y
    back = jnp.maximum(jnp.abs(here_x - left), jnp.abs(here_y - low)) <= tiny
    moved = (u != 0) | (v != 0)  # a single point stays where it is and keeps looking down
    return _Walk(
        count=walk.count + 1,
        x=here_x,
        y=here_y,
        u=jnp.where(moved, u, walk.u),
        v=jnp.where(moved, v, walk.v),
        normal_x=walk.normal_x.at[walk.count].set(v),
        normal_y=walk.normal_y.at[walk.count].set(-u),
        closed=walk.closed | back,
    )


def _numbers(x):
    """Point numbers along axis 0, to compare with arrays like x."""
    return jnp.arange(x.shape[0], dtype=jnp.int32).reshape((-1,) + (1,) * (x.ndim - 1))


UNIT = 2.0**-53
_OPERATIONS = 64  # more than any number computed here goes through


@struct.dataclass
class Shadows:
    """Lambda_P of r cells, T intervals and o obstacles:
    {p0 : edge.p0 <= edge_support and facet.p0 <= facet_support}.

    edge: (r, T, m, 2), largest entry 1 or zero; edge_support: (r, T, o, m).
    facet: (o, h, 2); facet_support: (r, T, o, h).
    slack: (r,) [m] covers the rounding of all of it: outside means beyond a support by more than
        the slack.
    """

    edge: np.ndarray
    edge_support: np.ndarray
    facet: np.ndarray
    facet_support: np.ndarray
    slack: np.ndarray


def edge_normals(offsets):
    """Normals of Q_t for one cell. offsets: (T + 1, v, 2) of its vertices at the knots. Returns
    (T, 2v, 2).
    """
    points = _swept(offsets)
    edge = jnp.stack(hull_normals(*jnp.moveaxis(points, (2, 1), (0, 1))), axis=2)  # (2v, T, 2)
    edge = jnp.swapaxes(edge, 0, 1)
    size = jnp.max(jnp.abs(edge), axis=2, keepdims=True)
    return edge / jnp.where(size > 0, size, 1)


def supports(edge, offsets, error, facet_b, facet, corners):
    """Supports of Lambda_P of one cell. Pure kernel.

    edge: (T, m, 2). offsets: (T + 1, v, 2). error: (T, 2). facet_b: (T, o, h). facet: (o, h, 2).
    corners: (o, c, 2) of obstacle + (-body). Returns edge_support (T, o, m), facet_support (T, o,
    h).
    """
    points = _swept(offsets)
    in_error_box = (jnp.abs(edge) * error[:, None]).sum(axis=2)
    swept = _support(edge, points[:, None]) + in_error_box  # (T, m)
    grown = _support(edge[:, None], corners[None, :, None])  # (T, o, m)
    knot = _support(facet[None], -offsets[:, None, None])  # (T + 1, o, h)
    along = jnp.maximum(knot[:-1], knot[1:])
    return grown + swept[:, None], facet_b + along


def shadows(cells: Cell, grown: GrownPolytopes) -> Shadows:
    """Lambda_P of r stacked cells for all intervals and obstacles. Exact up to `slack`."""
    offsets, slack = _offsets(cells, grown)
    edge, used = in_x64(_edge_normals, offsets)
    count = 1 + int(np.flatnonzero(used).max(initial=0))
    # the next multiple of four: few shapes compile
    edge = edge[:, :, : min(-(-count // 4) * 4, edge.shape[2])]
    error, b = grown.error[cells.bin], grown.b[cells.bin]
    along_edge, along_facet = in_x64(_supports, edge, offsets, error, b, grown.A, grown.corners)
    return Shadows(edge, along_edge, grown.A, along_facet, slack)


def in_x64(kernel, *arrays):
    """A kernel on the device in float64, its results on the host."""
    with x64():
        return jax.tree.map(np.asarray, kernel(*(jnp.asarray(one) for one in arrays)))


def margins(sh: Shadows, p0: np.ndarray) -> np.ndarray:
    """How far starts p0 (r, s, 2) lie beyond Lambda_P of their cell: (r, s, T, o) [m along a w of
    size <= 1].

    Positive outside, negative inside, up to `slack` and the rounding of p0.
    """
    return in_x64(_margins, p0, sh.edge, sh.edge_support, sh.facet_support, sh.facet)


def outside(sh: Shadows, p0: np.ndarray) -> np.ndarray:
    """Which starts p0 (r, s, 2) of each cell are proved outside Lambda_P: (r, s, T, o). False:
    inside or too close.
    """
    slack = sh.slack[:, None] + _OPERATIONS * UNIT * np.abs(p0).sum(axis=2)
    return margins(sh, p0) > slack[:, :, None, None]


def _offsets(cells: Cell, grown: GrownPolytopes) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (r, T + 1, v, 2) of the vertices at the knots, and the slack (r,) of the cells."""
    n_steps = grown.error.shape[1]
    r, v = cells.vertices.shape[:2]
    C = cells.C[:, : 2 * n_steps]
    d = cells.d[:, : 2 * n_steps]
    at_vertices = C @ cells.vertices.swapaxes(1, 2) + d[:, :, None]
    offsets = np.zeros((r, n_steps + 1, v, 2))
    offsets[:, 1:] = at_vertices.reshape(r, n_steps, 2, v).swapaxes(2, 3)
    size = (np.abs(C) @ cells.largest_k[:, :, None])[:, :, 0] + np.abs(d)
    # the cell's own error: other bins may be unclaimed
    error = np.abs(grown.error[cells.bin]).max(axis=(1, 2), initial=0)
    size = size.max(axis=1) + np.abs(grown.corners).max(initial=0) + error
    # Vertices are floats: the cell may reach further by its slip, and its image by C times that.
    moved = (np.abs(C) @ cells.slip[:, :, None]).max(axis=(1, 2))
    return offsets, 2 * moved + 4 * _OPERATIONS * UNIT * size


def _margin(p0, edge, edge_support, facet_support, facet):
    """One cell, one start (2,): (T, o)."""
    beyond_edge = (edge[..., 0] * p0[0] + edge[..., 1] * p0[1])[:, None] - edge_support
    beyond_facet = (facet[..., 0] * p0[0] + facet[..., 1] * p0[1])[None] - facet_support
    return jnp.maximum(beyond_edge.max(axis=2), beyond_facet.max(axis=2))


def _swept(offsets):
    """Points of Q_t: minus the offsets at both knots of every interval, (T, 2v, 2)."""
    return -jnp.concatenate([offsets[:-1], offsets[1:]], axis=1)


def _support(w, points):
    """Supports of points (..., v, 2) along w (..., d, 2): (..., d), with the leading axes
    broadcast.
    """
    return (w[..., :, None, 0] * points[..., 0] + w[..., :, None, 1] * points[..., 1]).max(axis=-1)


@jax.jit
def _edge_normals(offsets):
    """`edge_normals` of cell after cell (the arrays of one cell stay in cache), and which of the
    2v rows matter.

    Hulls have far fewer edges than points: rows that repeat the first edge in every set can go.
    """
    edge = jax.lax.map(edge_normals, offsets)
    return edge, (edge != edge[:, :, :1]).any(axis=(0, 1, 3))


_supports = jax.jit(jax.vmap(supports, in_axes=(0, 0, 0, 0, None, None)))
_margins = jax.jit(
    jax.vmap(jax.vmap(_margin, in_axes=(0, None, None, None, None)), in_axes=(0, 0, 0, 0, None))
)
