"""Keep one side of a cut: the part of the complex where a hyperplane's sign is minus or zero."""

import numpy as np

from parc_jax.pwa.complex import Complex, Level, SignBits
from parc_jax.pwa.growable import Growable, row_positions


def keep_minus(lattice: Complex, column: int) -> np.ndarray:
    """Drop all faces with a vertex of sign plus at `column`, and faces left without a cell. In place; for small
    complexes.

    Returns the new number of every old vertex, -1 where it was dropped.
    """
    n = lattice.n
    plus = lattice.bits.is_plus(column, column + 1)[:, 0]
    if not plus.any():
        return np.arange(lattice.x.n)
    rows = {k: lattice.rows(k) for k in range(1, n + 1)}
    radii = {k: lattice.radius(k).view[1:] for k in range(1, n)}
    label = lattice.label.view[1:] if n > 1 else lattice.label.view
    dropped = {0: plus}
    for k in range(1, n + 1):
        sub, size = rows[k][0], np.diff(rows[k][1])
        dropped[k] = np.zeros(len(size), bool)
        dropped[k][np.repeat(np.arange(len(size)), size)[dropped[k - 1][sub]]] = True
    # what remains of dimension < n must bound a remaining face one dimension up
    kept = {n: ~dropped[n]}
    for k in range(n, 0, -1):
        sub, size = rows[k][0], np.diff(rows[k][1])
        kept[k - 1] = np.zeros(lattice.count(k - 1) - (k > 1), bool)
        kept[k - 1][sub[np.repeat(kept[k], size)]] = True
    number = {k: np.where(kept[k], np.cumsum(kept[k]) - 1, -1) for k in range(n + 1)}
    levels, first = {}, None
    for k in range(1, n + 1):
        sub, offsets = rows[k]
        size = np.diff(offsets)
        positions, _ = row_positions(offsets[:-1][kept[k]], size[kept[k]])
        sub, size = number[k - 1][sub[positions]], size[kept[k]]
        heads = sub[np.cumsum(size) - size]
        if k == 1:
            lattice.a, lattice.b = (Growable(np.concatenate([[0], ends])) for ends in sub.reshape(-1, 2).T)
            first = heads
            if n > 1:
                lattice.edge_radius = Growable(np.concatenate([[0.0], radii[1][kept[1]]]))
            lattice.edge_home = Growable(np.zeros(lattice.a.n, int))
            continue
        first = first[heads]
        levels[k] = Level(sub + 1, size, first)
        if k < n:
            levels[k].radius = Growable(np.concatenate([[0.0], radii[k][kept[k]]]))
    lattice.levels = levels
    for name in ("x", "z", "rho", "vertex_home"):
        setattr(lattice, name, Growable(getattr(lattice, name).view[kept[0]]))
    bits, lattice.bits = lattice.bits, SignBits(0, 0)
    lattice.bits.plus, lattice.bits.minus = Growable(bits.plus.view[kept[0]]), Growable(bits.minus.view[kept[0]])
    lattice.label = Growable(label[kept[n - 1]] if n == 1 else np.concatenate([[-1], label[kept[n - 1]]]))
    return number[0]
