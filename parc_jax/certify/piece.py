"""A safe piece: pattern, bin, directions and one inner point. Everything else follows from them."""

from functools import cached_property
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.arrays import x64
from parc_jax.avoid.directions import Multiplier
from parc_jax.certify.cell import anchored_rows, cell_map
from parc_jax.sets.hpolytope import HPolytope


class Run(NamedTuple):
    """A direction that separates one obstacle from interval `first` up to, not including, `end`."""

    first: int
    end: int
    multiplier: Multiplier


class Piece:
    """The polytope of all (p0, k) with this pattern, in this bin, separated by these directions.

    p0 (n_p,), k (n_k,): a point strictly inside. pattern (n_hidden,) bool. born: [s] after the query began.
    w (o, T, 2), need (o, T): every inequality w . p^ > need, at both ends of every interval; float slack included.
    multipliers: per obstacle and interval what spells w exactly.
    """

    def __init__(self, model, scene, p0, k, pattern, bin_number: int, w, need, multipliers, born: float):
        self.p0, self.k, self.pattern, self.bin = p0, k, pattern, int(bin_number)
        self.w, self.need, self.multipliers, self.born = w, need, multipliers, born
        self._model, self._scene = model, scene

    @cached_property
    def runs(self) -> tuple[tuple[Run, ...], ...]:
        """Per obstacle, the intervals in which it exists as runs of equal directions."""
        out = []
        for spelled, active in zip(self.multipliers, self._scene.obstacles.active, strict=False):
            mine: list[Run] = []
            for t in np.flatnonzero(active):
                if mine and mine[-1].multiplier is spelled[t]:
                    mine[-1] = mine[-1]._replace(end=int(t) + 1)
                else:
                    mine.append(Run(int(t), int(t) + 1, spelled[t]))
            out.append(tuple(mine))
        return tuple(out)

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
