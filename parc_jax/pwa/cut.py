"""Cut every face of the complex along one hyperplane-per-cell function, given its exact sign at every vertex (T16).

A k-face F with both signs becomes F+ (keeps its number), F- (new) and the (k-1)-face F0 = F and {z = 0} between them.
Facets of F+ (F-): the facets of F with a + (-) vertex, a cut facet replaced by its own half, and F0. Facets of F0: G0
of the cut facets G of F, and every (k-2)-face of F on which z vanishes. No facet of a cut F lies in {z = 0}. That is
all there is, degenerate or not; without zero signs the last kind is empty and only faces with a cut edge are cut.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from parc_jax.errors import SoundnessError
from parc_jax.pwa.complex import Complex, Level
from parc_jax.pwa.growable import row_positions


class Slack(NamedTuple):
    """Rounding constants of one cut: eta of its neuron, delta of a new point; threshold (V,) of the signs.

    lip: of the neuron, in the given home cells. repair: called with the numbers of the new vertices, replaces floats
    that are too poor.
    """

    eta: float
    lip: Callable[[np.ndarray], np.ndarray]
    delta: float
    threshold: np.ndarray
    repair: Callable[[np.ndarray], None]


class Halved(NamedTuple):
    """The k-faces that were cut, in increasing order, and what became of them.

    codes: (count before,) OR of the vertex codes of every k-face: 1 plus, 2 minus, 3 cut, 0 zero.
    rank: position of a cut face in this record. minus0: number of the first F-, zero0: of the first F0.
    slope, rho: per cut face, lower bound of the slope across it and largest rho of its new vertices.
    """

    codes: np.ndarray
    rank: np.ndarray
    minus0: int
    zero0: int
    slope: np.ndarray
    rho: np.ndarray


def cut(lattice: Complex, codes: np.ndarray, column: int, z_column: int, slack: Slack) -> None:
    """Cut along column `column`, whose pre-activation is z[:, z_column]; codes (V,) uint8 as in SignBits.mark.

    The caller marks the column of the old vertices afterwards; the new ones are zero there.
    """
    no_zeros = bool(codes.all())
    below = _cut_edges(lattice, codes, column, z_column, slack)
    if no_zeros and not len(below.rho):
        return
    two_below = codes
    for k in range(2, lattice.n + 1):
        here = _cut_level(lattice, k, codes, no_zeros, below, two_below, column, slack)
        below, two_below = here, below.codes


def _cut_edges(lattice: Complex, vertex_codes, column: int, z_column: int, slack: Slack) -> Halved:
    a, b = lattice.a.view, lattice.b.view
    codes = vertex_codes[a] | vertex_codes[b]
    edges = np.flatnonzero(codes == 3)
    n_vertices, n_edges, count = lattice.x.n, lattice.a.n, len(edges)
    if not count:
        return Halved(codes, np.empty(0, int), n_edges, n_vertices, np.empty(0), np.empty(0))
    ends = a[edges], b[edges]
    radius = lattice.edge_radius.data[edges] if lattice.n > 1 else np.zeros(count)
    home = lattice.edge_home.data[edges]
    slope = _divide(lattice, *ends, radius, home, z_column, slack)
    new = np.arange(n_vertices, n_vertices + count)
    slack.repair(new)
    flip = vertex_codes[ends[0]] == 2
    lattice.a.data[edges] = np.where(flip, ends[1], ends[0])
    lattice.b.data[edges] = new
    lattice.a.append(np.where(flip, ends[0], ends[1]))
    lattice.b.append(new)
    lattice.edge_radius.append(radius)
    lattice.edge_home.append(home)
    _label_new(lattice, 0, count, column)
    if lattice.n == 2:
        lattice.label.append(lattice.label.data[edges])
    rank = np.empty(n_edges, int)
    rank[edges] = np.arange(count)
    return Halved(codes, rank, n_edges, n_vertices, slope, lattice.rho.data[new])


def _divide(lattice: Complex, p, q, radius, home, z_column: int, slack: Slack) -> np.ndarray:
    """New vertices where z vanishes on the edges (p, q). Returns slope bounds; appends floats and bits."""
    z = lattice.z.data
    # take: several times faster than indexing for rows
    z_p, z_q, x_p = z.take(p, axis=0), z.take(q, axis=0), lattice.x.data.take(p, axis=0)
    step = lattice.x.data.take(q, axis=0) - x_p
    at_p, at_q = z_p[:, z_column], z_q[:, z_column]
    t = (at_p / (at_p - at_q))[:, None]
    drop = np.abs(at_p) + np.abs(at_q) - slack.threshold[p] - slack.threshold[q]
    length = np.sqrt((step * step).sum(axis=1)) + (lattice.rho.data[p] + lattice.rho.data[q])
    slope = np.maximum(drop * (1 - 1e-9), 0.0) / length
    rho = _radius_of_zero(radius, slope, home, slack)
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


def _radius_of_zero(radius, slope, home, slack: Slack) -> np.ndarray:
    """radius(F0) from radius(F); infinite where the slope is not known to be positive."""
    known = slope > 0
    reach = (slack.eta + slack.lip(home) * radius) / np.where(known, slope, 1.0)
    return np.where(known, radius + reach * (1 + 1e-9) + slack.delta, np.inf)


def _cut_level(lattice, k, vertex_codes, no_zeros, below: Halved, two_below, column, slack) -> Halved:
    level: Level = lattice.levels[k]
    codes, faces = _codes(level, vertex_codes, no_zeros, below.codes)
    minus0, zero0, count = level.count, lattice.count(k - 1), len(faces)
    if not count:
        return Halved(codes, np.empty(0, int), minus0, zero0, np.empty(0), np.empty(0))
    start, size = level.start.data[faces], level.size.data[faces]
    # one more entry per row: F0 itself, of both sides
    at, ends = row_positions(start, size + 1)
    last, row = ends - 1, np.repeat(np.arange(count), size + 1)
    at[last] = 0
    sub = level.sub.data[at]
    sub_codes = below.codes[sub]
    level.sub.data[at] = level.own.data[at] = 0  # the old rows are dead; position 0 is the dummy's
    sub[last] = np.arange(zero0, zero0 + count)
    sub_codes[last] = 7
    cut_at = np.flatnonzero(sub_codes == 3)
    cut_rank, cut_row = below.rank[sub[cut_at]], row[cut_at]

    slope, rho = np.zeros(count), np.zeros(count)
    np.maximum.at(slope, cut_row, below.slope[cut_rank])
    np.maximum.at(rho, cut_row, below.rho[cut_rank])
    old_radius = level.radius.data[faces] if k < lattice.n else np.zeros(count)
    home = level.home.data[faces]
    zero_radius = np.minimum(_radius_of_zero(old_radius, slope, home, slack), rho)
    zero_sub, zero_row = below.zero0 + cut_rank, cut_row
    if not no_zeros:
        whole = (sub_codes == 1) | (sub_codes == 2)
        touch_row, touch = _zero_faces(lattice, k, row[whole], sub[whole], two_below)
        np.maximum.at(zero_radius, touch_row, lattice.radius(k - 2).data[touch])
        order = np.argsort(np.concatenate([zero_row, touch_row]), kind="stable")
        zero_sub = np.concatenate([zero_sub, touch])[order]
        zero_row = np.concatenate([zero_row, touch_row])[order]
    first = _append_zero_faces(lattice, k - 1, zero_sub, np.bincount(zero_row, minlength=count), zero_radius, home)
    _label_new(lattice, k - 1, count, column)

    plus, minus = (sub_codes & 1) != 0, (sub_codes & 2) != 0
    plus_sub, plus_row = sub[plus], row[plus]
    sub[cut_at] = below.minus0 + cut_rank
    minus_sub, minus_row = sub[minus], row[minus]
    sizes = np.bincount(plus_row, minlength=count), np.bincount(minus_row, minlength=count)
    starts = level.append_rows(
        np.concatenate([plus_sub, minus_sub]),
        np.concatenate([faces[plus_row], minus0 + minus_row]),
        np.concatenate(sizes),
    )
    level.start.data[faces], level.size.data[faces] = starts[:count], sizes[0]
    level.start.append(starts[count:])
    level.size.append(sizes[1])
    level.first.data[faces] = first
    level.first.append(first)
    level.radius.append(old_radius)
    level.home.append(home)
    if k == lattice.n - 1:
        lattice.label.append(lattice.label.data[faces])
    rank = np.empty(minus0, int)
    rank[faces] = np.arange(count)
    return Halved(codes, rank, minus0, zero0, slope, rho)


def _codes(level: Level, vertex_codes, no_zeros: bool, sub_codes) -> tuple[np.ndarray, np.ndarray]:
    """Codes of all faces of a level, and the faces that are cut."""
    if no_zeros:
        # both signs and no zero: the edge graph of F is connected, so a facet of F is cut as well
        hits = np.flatnonzero((sub_codes == 3)[level.sub.view])
        is_cut = np.zeros(level.count, bool)
        is_cut[level.own.data[hits]] = True
        faces = np.flatnonzero(is_cut)
        codes = vertex_codes[level.first.view]  # of no use where the face is cut
        codes[faces] = 3
        return codes, faces
    entry = sub_codes[level.sub.view]
    codes = np.zeros(level.count, np.uint8)
    for sign in (1, 2):
        has = np.zeros(level.count, bool)
        has[level.own.view[(entry & sign) != 0]] = True
        codes[has] |= sign
    codes[0] = 0
    return codes, np.flatnonzero(codes == 3)


def _zero_faces(lattice, k, row, sub, two_below) -> tuple[np.ndarray, np.ndarray]:
    """The (k-2)-faces with z = 0 of cut k-faces, once each: they lie in two uncut facets of the k-face."""
    if k == 2:
        flat, row = np.concatenate([lattice.a.data[sub], lattice.b.data[sub]]), np.concatenate([row, row])
    else:
        level = lattice.levels[k - 1]
        at, _ = row_positions(level.start.data[sub], level.size.data[sub])
        flat, row = level.sub.data[at], np.repeat(row, level.size.data[sub])
    zero = two_below[flat] == 0
    flat, row = flat[zero], row[zero]
    pairs = np.sort(row * np.int64(1 << 40) + flat)
    pairs = pairs[np.concatenate([[True], pairs[1:] != pairs[:-1]])] if len(pairs) else pairs
    return pairs >> 40, pairs & ((1 << 40) - 1)


def _append_zero_faces(lattice, k, sub, size, radius, home) -> np.ndarray:
    """Append the new k-faces with the given boundaries; returns a vertex of each."""
    if k == 1:
        if not (size == 2).all():
            raise SoundnessError(
                "cut: a polygon was cut in other than two points, so a sign was wrong; please report the network."
            )
        ends = sub.reshape(-1, 2)
        lattice.a.append(ends[:, 0])
        lattice.b.append(ends[:, 1])
        lattice.edge_radius.append(radius)
        lattice.edge_home.append(home)
        return ends[:, 0]
    level = lattice.levels[k]
    starts = level.append_rows(sub, np.repeat(np.arange(level.count, level.count + len(size)), size), size)
    heads = sub[np.cumsum(size) - size]
    first = lattice.a.data[heads] if k == 2 else lattice.levels[k - 1].first.data[heads]
    level.start.append(starts)
    level.size.append(size)
    level.first.append(first)
    level.radius.append(radius)
    level.home.append(home)
    return first


def _label_new(lattice, k: int, count: int, column: int) -> None:
    if k == lattice.n - 1:
        lattice.label.append(np.full(count, column))
