"""A safe piece: a corridor in one cell. Everything else follows from pattern, bin, directions and one inner point."""

from functools import cached_property

import jax
import numpy as np

from parc_jax.arrays import x64
from parc_jax.certify.cell import anchored_rows, cell_map
from parc_jax.certify.corridor import Corridor
from parc_jax.certify.draw import cell_of
from parc_jax.sets.hpolytope import HPolytope


class Piece:
    """The polytope of all (p0, k) with this pattern, in this bin, that keep to the corridor.

    p0 (n_p,), k (n_k,): a point strictly inside. pattern (n_hidden,) bool. born: [s] after the query began.
    w (o, T, 2), need (o, T): every inequality w . p^ > need, at both ends of every interval; float slack included.
    """

    def __init__(self, model, scene, p0, k, pattern, bin_number: int, corridor: Corridor, born: float):
        self.p0, self.k, self.pattern, self.bin, self.corridor = p0, k, pattern, int(bin_number), corridor
        self.born = born
        self.w, self.need = corridor.w, corridor.need(model.tube.interval[self.bin])
        self._model, self._scene = model, scene

    @property
    def cell(self) -> bytes:
        """Name of its region and bin, as points have it."""
        return cell_of(self.pattern[None], np.array([self.bin]))[0].tobytes()

    @cached_property
    def polytope(self) -> HPolytope:
        """The piece as float64 rows over (p0, k); every row is pulled in by the float slack."""
        model, scene, slack = self._model, self._scene, float(self._scene.slack)
        lo, hi = model.tube.bin_box(self.bin)
        with x64():
            parts = _cell_rows(model.net, model.tube, scene.arrays, self.pattern, model.tube.final[self.bin], lo, hi)
        A, b, C, d = (np.asarray(x) for x in parts)
        rows, bounds = [A], [b]
        active = np.asarray(scene.obstacles.active)
        for shift in (0, 1):
            knots = slice(shift, shift + model.time.n_steps)
            along = np.einsum("otp,tpk->otk", self.w, C[knots])
            offset = np.einsum("otp,tp->ot", self.w, d[knots])
            rows.append(-np.concatenate([self.w, along], axis=2)[active])
            bounds.append((offset - self.need)[active])
        A, b = np.concatenate(rows), np.concatenate(bounds)
        size = np.abs(A).sum(axis=1)
        real = size > 0
        return HPolytope(A[real], b[real] - slack * size[real])


@jax.jit
def _cell_rows(net, tube, scene, pattern, final, lo, hi):
    cell = cell_map(net, pattern, *tube.interval.shape[1:])
    return *anchored_rows(scene, cell, final, lo, hi), cell.C, cell.d
