"""Keep one side of a cut: the part of the complex where a hyperplane's sign is minus or zero."""

import numpy as np

from parc_jax.proof.regions.complex import Complex, Level
from parc_jax.proof.regions.storage import Growable, Ragged, row_positions


def keep_minus(lattice: Complex, column: int) -> np.ndarray:
    """Drop all faces with a vertex of sign plus at `column`, and faces left without a cell. In
    place; for small complexes.

    Returns the new number of every old vertex, -1 where it was dropped.
    """
    n = lattice.n
    plus = lattice.bits.is_plus(column, column + 1)[:, 0]
    if not plus.any():
        return np.arange(lattice.x.n)
    rows = {k: lattice.rows(k) for k in range(1, n + 1)}
    radius = {k: lattice.radius(k).view[1:] for k in range(1, n)}
    label = lattice.label.view[1:] if n > 1 else lattice.label.view
    kept = _kept_faces(rows, plus, n)
    number = {k: np.where(kept[k], np.cumsum(kept[k]) - 1, -1) for k in range(n + 1)}

    sub, _ = _kept_rows(rows[1], kept[1], number[0])
    ends = sub.reshape(-1, 2)
    lattice.set_edges(ends[:, 0], ends[:, 1], radius[1][kept[1]] if n > 1 else None)
    first = ends[:, 0]
    lattice.levels = {}
    for k in range(2, n + 1):
        sub, size = _kept_rows(rows[k], kept[k], number[k - 1])
        first = first[sub[np.cumsum(size) - size]]
        lattice.levels[k] = Level(sub + 1, size, first, radius[k][kept[k]] if k < n else None)
    lattice.x = Growable(lattice.x.view[kept[0]])
    lattice.z = Growable(lattice.z.view[kept[0]])
    lattice.rho = Growable(lattice.rho.view[kept[0]])
    lattice.vertex_home = Growable(lattice.vertex_home.view[kept[0]])
    lattice.bits = lattice.bits.kept(kept[0])
    lattice.set_labels(label[kept[n - 1]])
    return number[0]


def _kept_faces(rows: dict[int, Ragged], plus: np.ndarray, n: int) -> dict[int, np.ndarray]:
    """Bool per k-face, k = 0..n: it stays."""
    dropped = plus
    count = {0: len(plus)}
    for k in range(1, n + 1):
        sub, offsets = rows[k]
        count[k] = len(offsets) - 1
        has_dropped = np.zeros(count[k], bool)
        has_dropped[np.repeat(np.arange(count[k]), np.diff(offsets))[dropped[sub]]] = True
        dropped = has_dropped
    # what remains of dimension < n must bound a remaining face one dimension up
    kept = {n: ~dropped}
    for k in range(n, 0, -1):
        sub, offsets = rows[k]
        kept[k - 1] = np.zeros(count[k - 1], bool)
        kept[k - 1][sub[np.repeat(kept[k], np.diff(offsets))]] = True
    return kept


def _kept_rows(rows: Ragged, kept: np.ndarray, number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Boundaries of the kept faces in new numbers, flat, and how many each has."""
    sub, offsets = rows
    size = np.diff(offsets)[kept]
    positions, _ = row_positions(offsets[:-1][kept], size)
    return number[sub[positions]], size
