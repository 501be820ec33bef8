"""Cut edges at a hyperplane: new vertices, their floats and the bounds on them; what a cut of any
dimension hands on to the next.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, UInt8

from parc_jax.proof.regions.complex import Complex, Sign


class Slack(NamedTuple):
    """Rounding constants of one cut.

    eta: of its neuron. delta: of a new point. threshold: (V,) of the signs.
    lip: of the neuron, in the given home cells.
    repair: called with the numbers of the new vertices, replaces floats that are too poor.
    """

    eta: float
    lip: Callable[[np.ndarray], np.ndarray]
    delta: float
    threshold: np.ndarray
    repair: Callable[[np.ndarray], None]


class Halved(NamedTuple):
    """The k-faces that were cut, in increasing order, and what became of them.

    codes: (count before,) OR of the `Sign` of the vertices of every k-face.
    rank: position of a cut face in this record.
    minus0: number of the first F-. zero0: of the first F0.
    slope, rho: per cut face, lower bound of the slope across it and largest rho of its new
        vertices.
    """

    codes: np.ndarray
    rank: np.ndarray
    minus0: int
    zero0: int
    slope: np.ndarray
    rho: np.ndarray


def cut_edges(
    lattice: Complex,
    vertex_codes: UInt8[np.ndarray, " V"],
    column: int,
    z_column: int,
    slack: Slack,
) -> Halved:
    """Cut every edge with a plus and a minus end. vertex_codes (V,): `Sign` at column `column`,
    whose pre-activation is z[:, z_column].
    """
    a = lattice.a.view
    b = lattice.b.view
    codes = vertex_codes.take(a) | vertex_codes.take(b)
    edges = np.flatnonzero(codes == Sign.CUT)
    count = len(edges)
    vertex0 = lattice.x.n
    edge0 = lattice.a.n
    if not count:
        return nothing_cut(codes, edge0, vertex0)
    p = a[edges]
    q = b[edges]
    radius = lattice.edge_radius.data[edges] if lattice.n > 1 else np.zeros(count)
    home = lattice.edge_home.data[edges]
    slope = _divide(lattice, p, q, radius, home, z_column, slack)
    new = np.arange(vertex0, vertex0 + count)
    slack.repair(new)
    # the edge keeps its number on the plus side; the part on the minus side is new
    flip = vertex_codes.take(p) == Sign.MINUS
    lattice.a.data[edges] = np.where(flip, q, p)
    lattice.b.data[edges] = new
    lattice.a.append(np.where(flip, p, q))
    lattice.b.append(new)
    lattice.edge_radius.append(radius)
    lattice.edge_home.append(home)
    label_new(lattice, 0, count, column)
    if lattice.n == 2:
        lattice.label.append(lattice.label.data[edges])
    return Halved(codes, ranks(edges, edge0), edge0, vertex0, slope, lattice.rho.data[new])


def nothing_cut(codes: UInt8[np.ndarray, " F"], minus0: int, zero0: int) -> Halved:
    """The record of a dimension in which no face was cut."""
    return Halved(codes, np.empty(0, int), minus0, zero0, np.empty(0), np.empty(0))


def ranks(cut_faces: np.ndarray, count: int) -> np.ndarray:
    """Position of each cut face among the cut ones: (count,), undefined elsewhere."""
    rank = np.empty(count, int)
    rank[cut_faces] = np.arange(len(cut_faces))
    return rank


def _divide(
    lattice: Complex,
    p: Int[np.ndarray, " E"],
    q: Int[np.ndarray, " E"],
    radius: Float[np.ndarray, " E"],
    home: Int[np.ndarray, " E"],
    z_column: int,
    slack: Slack,
) -> np.ndarray:
    """New vertices where z vanishes on the edges (p, q). Returns slope bounds; appends floats and
    bits.
    """
    z = lattice.z.data
    # take: several times faster than indexing for rows
    z_p = z.take(p, axis=0)
    z_q = z.take(q, axis=0)
    x_p = lattice.x.data.take(p, axis=0)
    step = lattice.x.data.take(q, axis=0) - x_p
    at_p = z_p[:, z_column]
    at_q = z_q[:, z_column]
    t = (at_p / (at_p - at_q))[:, None]
    drop = np.abs(at_p) + np.abs(at_q) - slack.threshold[p] - slack.threshold[q]
    length = np.sqrt((step * step).sum(axis=1)) + (lattice.rho.data[p] + lattice.rho.data[q])
    slope = np.maximum(drop * (1 - 1e-9), 0.0) / length
    rho = radius_of_zero(radius, slope, home, slack)
    # in place: z_q becomes z_p + t (z_q - z_p), step the new point
    z_q -= z_p
    z_q *= t
    z_q += z_p
    step *= t
    step += x_p
    lattice.x.append(step)
    lattice.z.append(z_q)
    lattice.rho.append(rho)
    lattice.vertex_home.append(home)
    lattice.bits.inherit(p, q)
    return slope


def radius_of_zero(
    radius: Float[np.ndarray, " E"],
    slope: Float[np.ndarray, " E"],
    home: Int[np.ndarray, " E"],
    slack: Slack,
) -> np.ndarray:
    """radius(F0) from radius(F); infinite where the slope is not known to be positive."""
    known = slope > 0
    further = (slack.eta + slack.lip(home) * radius) / np.where(known, slope, 1.0)
    return np.where(known, radius + further * (1 + 1e-9) + slack.delta, np.inf)


def label_new(lattice: Complex, k: int, count: int, column: int) -> None:
    """Label the last `count` k-faces with the column that carries them, if they are facets."""
    if k == lattice.n - 1:
        lattice.label.append(np.full(count, column))
