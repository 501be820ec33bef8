"""Cut every face of the complex along one hyperplane-per-cell function, given its exact sign at
every vertex [T16].

A k-face F with both signs becomes F+ (with its number), F- (new) and the (k-1)-face F0 = F and {z
= 0} between them. Facets of F+ (F-): the facets of F with a + (-) vertex, a cut facet replaced by
its half, and F0. Facets of F0: G0 of the cut facets G of F, and every (k-2)-face of F on which
z vanishes. No facet of a cut F lies in {z = 0}. That is all there is, degenerate or not; without
zero signs the last kind is empty and only faces with a cut edge are cut.

Cut edges at a hyperplane: new vertices, their floats and the bounds on them; a cut hands
the record of one dimension on to the next.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, UInt8

from parc_jax.common.arrays import slices
from parc_jax.common.errors import SoundnessError
from parc_jax.proof.regions.complex import Complex, Level, Sign
from parc_jax.proof.regions.storage import CHUNK, NUMBER, row_chunks, row_positions

Edges = Int[np.ndarray, " E"]  # numbers, of each edge or cut face
Bounds = Float[np.ndarray, " E"]


class Hyperplane(NamedTuple):
    """One hyperplane per cell, and the rounding constants of a cut along it.

    column: of its signs. z_column: of its pre-activations.
    eta: of its neuron. delta: of a new point. threshold: (V,) of the signs.
    lip: of the neuron, in the given home cells.
    repair: called with the numbers of the new vertices, replaces floats that are too poor.
    """

    column: int
    z_column: int
    eta: float
    lip: Callable[[np.ndarray], np.ndarray]
    delta: float
    threshold: np.ndarray
    repair: Callable[[np.ndarray], None]


class Halved(NamedTuple):
    """The k-faces that were cut, in increasing order, and their halves.

    codes: (count before,) OR of the `Sign` of the vertices of every k-face.
    rank: position of a cut face in this record.
    minus0: number of the first F-. zero0: of the first F0.
    slope, rho: per cut face, lower bound of the slope across it and largest rho of new vertices.
    """

    codes: np.ndarray
    rank: np.ndarray
    minus0: int
    zero0: int
    slope: np.ndarray
    rho: np.ndarray


def cut_edges(lattice: Complex, vertex_codes: UInt8[np.ndarray, " V"], plane: Hyperplane) -> Halved:
    """Cut every edge with a plus and a minus end. vertex_codes (V,): `Sign` at the hyperplane."""
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
    slope = _divide(lattice, p, q, edges, plane)
    new = np.arange(vertex0, vertex0 + count)
    plane.repair(new)
    # the edge keeps its number on the plus side; the part on the minus side is new
    flip = vertex_codes.take(p) == Sign.MINUS
    lattice.a.data[edges] = np.where(flip, q, p)
    lattice.b.data[edges] = new
    lattice.a.append(np.where(flip, p, q))
    lattice.b.append(new)
    lattice.halve(1, edges)
    return Halved(codes, ranks(edges, edge0), edge0, vertex0, slope, lattice.rho.data[new])


def nothing_cut(codes: UInt8[np.ndarray, " F"], minus0: int, zero0: int) -> Halved:
    """The record of a dimension in which no face was cut."""
    return Halved(codes, np.empty(0, int), minus0, zero0, np.empty(0), np.empty(0))


def ranks(cut_faces: np.ndarray, count: int) -> np.ndarray:
    """Position of each cut face among the cut ones: (count,), undefined elsewhere."""
    rank = np.empty(count, int)
    rank[cut_faces] = np.arange(len(cut_faces))
    return rank


def _divide(lattice: Complex, p: Edges, q: Edges, edges: Edges, plane: Hyperplane) -> np.ndarray:
    """New vertices where z = 0 on edges (p, q). Returns slope bounds; appends floats and bits."""
    z = lattice.z.data
    # take: several times faster than indexing for rows
    z_p = z.take(p, axis=0)
    z_q = z.take(q, axis=0)
    x_p = lattice.x.data.take(p, axis=0)
    step = lattice.x.data.take(q, axis=0) - x_p
    at_p = z_p[:, plane.z_column]
    at_q = z_q[:, plane.z_column]
    t = (at_p / (at_p - at_q))[:, None]
    drop = np.abs(at_p) + np.abs(at_q) - plane.threshold[p] - plane.threshold[q]
    length = np.sqrt((step * step).sum(axis=1)) + (lattice.rho.data[p] + lattice.rho.data[q])
    slope = np.maximum(drop * (1 - 1e-9), 0.0) / length
    home = lattice.home[1].data[edges]
    rho = radius_of_zero(lattice.radius[1].data[edges], slope, home, plane)
    # in place: z_q becomes z_p + t (z_q - z_p), step the new point
    z_q -= z_p
    z_q *= t
    z_q += z_p
    step *= t
    step += x_p
    lattice.x.append(step)
    lattice.z.append(z_q)
    lattice.enter(0, rho, home, plane.column)
    lattice.bits.inherit(p, q)
    return slope


def radius_of_zero(radius: Bounds, slope: Bounds, home: Edges, plane: Hyperplane) -> np.ndarray:
    """radius(F0) from radius(F); infinite where the slope may be zero."""
    known = slope > 0
    further = (plane.eta + plane.lip(home) * radius) / np.where(known, slope, 1.0)
    return np.where(known, radius + further * (1 + 1e-9) + plane.delta, np.inf)


class Rows(NamedTuple):
    """Boundaries of the cut faces F of one dimension, entry by entry, each row ending in its F0.

    face: (m,) which of the cut faces. facet: (m,) its facet. codes: (m,) `Sign` of the facet.
    """

    face: np.ndarray
    facet: np.ndarray
    codes: np.ndarray


def cut(lattice: Complex, codes: np.ndarray, plane: Hyperplane) -> None:
    """Cut along a hyperplane; codes (V,) uint8, see `Sign`.

    The caller marks the column of the old vertices afterwards; the new ones are zero there.
    """
    no_zeros = bool(codes.all())
    below = cut_edges(lattice, codes, plane)
    if no_zeros and not len(below.rho):
        return
    two_below = codes
    for k in range(2, lattice.n + 1):
        here = _cut_level(lattice, k, codes, no_zeros, below, two_below, plane)
        two_below = below.codes
        below = here


def _cut_level(
    lattice: Complex,
    k: int,
    vertex_codes: UInt8[np.ndarray, " V"],
    no_zeros: bool,
    below: Halved,
    two_below: UInt8[np.ndarray, " G"] | None,
    plane: Hyperplane,
) -> Halved:
    """Cut the k-faces, when the (k-1)-faces are cut. two_below: codes of the (k-2)-faces."""
    level = lattice.levels[k]
    codes, faces = _codes(level, vertex_codes, no_zeros, below.codes)
    minus0 = level.count
    zero0 = lattice.count(k - 1)
    if not len(faces):
        return nothing_cut(codes, minus0, zero0)
    slope = np.zeros(len(faces))
    rho = np.zeros(len(faces))
    radius = lattice.radius[k].data[faces]
    home = lattice.home[k].data[faces]
    first = np.empty(len(faces), NUMBER)
    ends = np.cumsum(level.size.data[faces] + 1)
    for start, stop in row_chunks(np.concatenate([[0], ends]), CHUNK):
        part = slice(start, stop)
        rows = _take_rows(level, faces[part], below.codes, zero0 + start)
        is_cut = np.flatnonzero(rows.codes == Sign.CUT)
        cut_rank = below.rank.take(rows.facet.take(is_cut))
        cut_face = rows.face.take(is_cut)
        # the slope across any cut facet is one within the face: the steepest bounds best
        np.maximum.at(slope[part], cut_face, below.slope.take(cut_rank))
        np.maximum.at(rho[part], cut_face, below.rho.take(cut_rank))
        zero_radius = radius_of_zero(radius[part], slope[part], home[part], plane)
        np.minimum(zero_radius, rho[part], out=zero_radius)
        zero_row = cut_face
        zero_sub = below.zero0 + cut_rank
        if not no_zeros:
            touching_row, touching = _zero_faces(lattice, k, rows, two_below)
            np.maximum.at(zero_radius, touching_row, lattice.radius[k - 2].data[touching])
            zero_row = np.concatenate([zero_row, touching_row])
            order = np.argsort(zero_row, kind="stable")
            zero_row = zero_row[order]
            zero_sub = np.concatenate([zero_sub, touching])[order]
        zero_size = np.bincount(zero_row, minlength=stop - start)
        first[part] = _append_zero_faces(lattice, k - 1, zero_sub, zero_size)
        lattice.enter(k - 1, zero_radius, home[part], plane.column)
        _store_halves(level, faces[part], rows, is_cut, below.minus0 + cut_rank)
    level.first.data[faces] = first
    level.first.append(first)
    lattice.halve(k, faces)
    return Halved(codes, ranks(faces, minus0), minus0, zero0, slope, rho)


def _take_rows(
    level: Level, faces: np.ndarray, sub_codes: UInt8[np.ndarray, " G"], zero0: int
) -> Rows:
    """Take the boundaries of the cut faces out of the pool, with the new F0 at the end of each."""
    size = level.size.data[faces]
    at, ends = row_positions(level.start.data[faces], size + 1)
    last = ends - 1
    at[last] = 0
    facet = level.sub.data.take(at)
    codes = sub_codes.take(facet)
    # the old rows are dead; position 0 is the dummy's
    level.sub.data[at] = 0
    level.own.data[at] = 0
    facet[last] = np.arange(zero0, zero0 + len(faces))
    codes[last] = Sign.NEW
    return Rows(np.repeat(np.arange(len(faces)), size + 1), facet, codes)


def _store_halves(
    level: Level,
    faces: Int[np.ndarray, " cut"],
    rows: Rows,
    is_cut: Int[np.ndarray, " halves"],
    minus_halves: Int[np.ndarray, " halves"],
) -> None:
    """Append the boundaries of F+ (numbers as before) and F- (new), for cut faces in their order.

    is_cut: the entries that are cut facets, whose number is that of their plus half; minus_halves:
    numbers of their minus halves.
    """
    plus = np.flatnonzero(rows.codes & Sign.PLUS)
    minus = np.flatnonzero(rows.codes & Sign.MINUS)
    plus_facet = rows.facet.take(plus)
    rows.facet[is_cut] = minus_halves  # of no other use from here on
    plus_face = rows.face.take(plus)
    minus_face = rows.face.take(minus)
    count = len(faces)
    plus_size = np.bincount(plus_face, minlength=count)
    minus_size = np.bincount(minus_face, minlength=count)
    starts = level.append_rows(
        np.concatenate([plus_facet, rows.facet.take(minus)]),
        np.concatenate([faces.take(plus_face), level.count + minus_face]),
        np.concatenate([plus_size, minus_size]),
    )
    level.start.data[faces] = starts[:count]
    level.size.data[faces] = plus_size
    level.start.append(starts[count:])
    level.size.append(minus_size)


def _codes(
    level: Level,
    vertex_codes: UInt8[np.ndarray, " V"],
    no_zeros: bool,
    sub_codes: UInt8[np.ndarray, " G"],
) -> tuple[np.ndarray, np.ndarray]:
    """Codes of all faces of a level, and the faces that are cut."""
    if no_zeros:
        # both signs and no zero: the edge graph of F is connected, so a facet of F is cut as well
        sub_is_cut = sub_codes == Sign.CUT
        is_cut = np.zeros(level.count, bool)
        for part in slices(level.sub.n, CHUNK):
            hits = np.flatnonzero(sub_is_cut.take(level.sub.data[part]))
            is_cut[level.own.data[part].take(hits)] = True
        faces = np.flatnonzero(is_cut)
        codes = vertex_codes.take(level.first.view)  # of no use where the face is cut
        codes[faces] = Sign.CUT
        return codes, faces
    has = np.zeros((2, level.count), bool)
    for part in slices(level.sub.n, CHUNK):
        entry = sub_codes.take(level.sub.data[part])
        own = level.own.data[part]
        for row, sign in zip(has, (Sign.PLUS, Sign.MINUS), strict=True):
            row[own[(entry & sign) != 0]] = True
    codes = has[0] * Sign.PLUS + has[1] * Sign.MINUS
    codes[0] = Sign.ZERO
    return codes, np.flatnonzero(codes == Sign.CUT)


def _zero_faces(
    lattice: Complex, k: int, rows: Rows, two_below: UInt8[np.ndarray, " G"]
) -> tuple[np.ndarray, np.ndarray]:
    """The (k-2)-faces with z = 0 of cut k-faces, once each, and the cut face of each: they lie in
    two uncut facets of the k-face.
    """
    whole = (rows.codes == Sign.PLUS) | (rows.codes == Sign.MINUS)
    row = rows.face[whole]
    facet = rows.facet[whole]
    if k == 2:
        flat = np.concatenate([lattice.a.data[facet], lattice.b.data[facet]])
        row = np.concatenate([row, row])
    else:
        level = lattice.levels[k - 1]
        size = level.size.data[facet]
        at, _ = row_positions(level.start.data[facet], size)
        flat = level.sub.data[at]
        row = np.repeat(row, size)
    zero = two_below[flat] == Sign.ZERO
    # one number for each pair of a face and a zero face
    pairs = np.unique(row[zero] * np.int64(1 << 40) + flat[zero])
    return pairs >> 40, pairs & ((1 << 40) - 1)


def _append_zero_faces(
    lattice: Complex, k: int, sub: Int[np.ndarray, " entries"], size: Int[np.ndarray, " new"]
) -> np.ndarray:
    """Append the new k-faces with the given boundaries; returns a vertex of each."""
    if k == 1:
        if not (size == 2).all():
            raise SoundnessError(
                "cut: a polygon was cut in other than two points, so a sign was wrong; please "
                "report the network."
            )
        ends = sub.reshape(-1, 2)
        lattice.a.append(ends[:, 0])
        lattice.b.append(ends[:, 1])
        return ends[:, 0]
    level = lattice.levels[k]
    own = np.repeat(np.arange(level.count, level.count + len(size)), size)
    starts = level.append_rows(sub, own, size)
    heads = sub[np.cumsum(size) - size]
    first = lattice.a.data[heads] if k == 2 else lattice.levels[k - 1].first.data[heads]
    level.start.append(starts)
    level.size.append(size)
    level.first.append(first)
    return first
