"""Cut every face of the complex along one hyperplane-per-cell function, given its exact sign at
every vertex [T16].

A k-face F with both signs becomes F+ (keeps its number), F- (new) and the (k-1)-face F0 = F and {z
= 0} between them. Facets of F+ (F-): the facets of F with a + (-) vertex, a cut facet replaced by
its own half, and F0. Facets of F0: G0 of the cut facets G of F, and every (k-2)-face of F on which
z vanishes. No facet of a cut F lies in {z = 0}. That is all there is, degenerate or not; without
zero signs the last kind is empty and only faces with a cut edge are cut.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, UInt8

from parc_jax.common.arrays import slices
from parc_jax.common.errors import SoundnessError
from parc_jax.proof.regions.complex import Complex, Level, Sign
from parc_jax.proof.regions.cut_edges import (
    Halved,
    Slack,
    cut_edges,
    label_new,
    nothing_cut,
    radius_of_zero,
    ranks,
)
from parc_jax.proof.regions.storage import CHUNK, NUMBER, row_chunks, row_positions


class Rows(NamedTuple):
    """Boundaries of the cut faces F of one dimension, entry by entry, each row ending in its F0.

    face: (m,) which of the cut faces. facet: (m,) its facet. codes: (m,) `Sign` of the facet.
    """

    face: np.ndarray
    facet: np.ndarray
    codes: np.ndarray


def cut(lattice: Complex, codes: np.ndarray, column: int, z_column: int, slack: Slack) -> None:
    """Cut along column `column`, whose pre-activation is z[:, z_column]; codes (V,) uint8, see
    `Sign`.

    The caller marks the column of the old vertices afterwards; the new ones are zero there.
    """
    no_zeros = bool(codes.all())
    below = cut_edges(lattice, codes, column, z_column, slack)
    if no_zeros and not len(below.rho):
        return
    two_below = codes
    for k in range(2, lattice.n + 1):
        here = _cut_level(lattice, k, codes, no_zeros, below, two_below, column, slack)
        two_below = below.codes
        below = here


def _cut_level(
    lattice: Complex,
    k: int,
    vertex_codes: UInt8[np.ndarray, " V"],
    no_zeros: bool,
    below: Halved,
    two_below: UInt8[np.ndarray, " G"] | None,
    column: int,
    slack: Slack,
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
    radius = level.radius.data[faces] if k < lattice.n else np.zeros(len(faces))
    home = level.home.data[faces]
    first = np.empty(len(faces), NUMBER)
    ends = np.cumsum(level.size.data[faces] + 1)
    for start, stop in row_chunks(np.concatenate([[0], ends]), CHUNK):
        part = slice(start, stop)
        rows = _take_rows(level, faces[part], below.codes, zero0 + start)
        is_cut = np.flatnonzero(rows.codes == Sign.CUT)
        cut_rank = below.rank.take(rows.facet.take(is_cut))
        cut_face = rows.face.take(is_cut)
        np.maximum.at(slope[part], cut_face, below.slope.take(cut_rank))
        np.maximum.at(rho[part], cut_face, below.rho.take(cut_rank))
        zero_radius = radius_of_zero(radius[part], slope[part], home[part], slack)
        np.minimum(zero_radius, rho[part], out=zero_radius)
        zero_row = cut_face
        zero_sub = below.zero0 + cut_rank
        if not no_zeros:
            touching_row, touching = _zero_faces(lattice, k, rows, two_below)
            np.maximum.at(zero_radius, touching_row, lattice.radius(k - 2).data[touching])
            zero_row = np.concatenate([zero_row, touching_row])
            order = np.argsort(zero_row, kind="stable")
            zero_row = zero_row[order]
            zero_sub = np.concatenate([zero_sub, touching])[order]
        zero_size = np.bincount(zero_row, minlength=stop - start)
        first[part] = _append_zero_faces(
            lattice, k - 1, zero_sub, zero_size, zero_radius, home[part]
        )
        _store_halves(level, faces[part], rows, is_cut, below.minus0 + cut_rank)
    label_new(lattice, k - 1, len(faces), column)
    if k == lattice.n - 1:
        lattice.label.append(lattice.label.data[faces])
    level.first.data[faces] = first
    level.first.append(first)
    level.radius.append(radius)
    level.home.append(home)
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
    pairs = np.sort(row[zero] * np.int64(1 << 40) + flat[zero])
    if len(pairs):
        pairs = pairs[np.concatenate([[True], pairs[1:] != pairs[:-1]])]
    return pairs >> 40, pairs & ((1 << 40) - 1)


def _append_zero_faces(
    lattice: Complex,
    k: int,
    sub: Int[np.ndarray, " entries"],
    size: Int[np.ndarray, " new"],
    radius: Float[np.ndarray, " new"],
    home: Int[np.ndarray, " new"],
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
        lattice.edge_radius.append(radius)
        lattice.edge_home.append(home)
        return ends[:, 0]
    level = lattice.levels[k]
    own = np.repeat(np.arange(level.count, level.count + len(size)), size)
    starts = level.append_rows(sub, own, size)
    heads = sub[np.cumsum(size) - size]
    first = lattice.a.data[heads] if k == 2 else lattice.levels[k - 1].first.data[heads]
    level.start.append(starts)
    level.size.append(size)
    level.first.append(first)
    level.radius.append(radius)
    level.home.append(home)
    return first
