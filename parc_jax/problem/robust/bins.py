"""Bins of the chosen parameters, each with the errors of every bin that an execution may be in.
[T21]

Everything that decides is compared exactly; edges are rounded so that no plan is counted to a bin
with too few errors.
"""

import itertools
import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from parc_jax.common.lp.exact import round_down, round_up
from parc_jax.problem.robust.realisations import Executions

MOST = 256  # bins, unless the old ones ask for more
COARSEST = 1e6


class Axis(NamedTuple):
    """One axis of k. edges: of the new bins, None for an axis that is not chosen. met: for each new
    bin (or the only one) the first and last old bin that its executions may be in.
    """

    edges: np.ndarray | None
    met: list[tuple[int, int]]


def axis_of(edges: np.ndarray, lo: float, hi: float, chosen: bool, finest: float = np.inf) -> Axis:
    """Of old edges, and what executions add (chosen), or the values that they have. finest: largest
    width of the new bins of an axis on which they add something.
    """
    exact = [Fraction(e) for e in edges]
    low, high = Fraction(lo), Fraction(hi)
    if not chosen:
        return Axis(None, [_met(exact, low, high, closed=True)])
    if low == high == 0:
        return Axis(edges, [(i, i) for i in range(len(edges) - 1)])
    first, last = round_up(exact[0] - low), round_down(exact[-1] - high)
    inner = [f for e in exact[1:-1] for f in (round_down(e - high), round_up(e - low))]
    n_even = int(np.ceil((last - first) / finest))
    even = np.linspace(first, last, n_even + 1)[1:-1] if n_even > 1 else []
    new = np.unique([first, last, *(f for f in [*inner, *even] if first < f < last)])
    pairs = itertools.pairwise(new)
    return Axis(new, [_met(exact, Fraction(a) + low, Fraction(b) + high, False) for a, b in pairs])


def _met(edges: list[Fraction], lo: Fraction, hi: Fraction, closed: bool) -> tuple[int, int]:
    """First and last bin that meets [lo, hi], or only what lies between."""
    meets = []
    for i, (a, b) in enumerate(itertools.pairwise(edges)):
        inside = a < hi and lo < b
        touches = closed and a <= hi and lo <= b
        if inside or touches:
            meets.append(i)
    return meets[0], meets[-1]


def axes_of(edges: tuple[np.ndarray, ...], executions: Executions) -> list[Axis]:
    """All axes of k, those that are not chosen among them. New bins are as fine as what an
    execution may be off by, so that few kinks of the network count in each, but no more than MOST
    in all.
    """
    coarse = 1.0
    while True:
        finest = coarse * (executions.hi - executions.lo)
        axes = [
            axis_of(e, executions.lo[i], executions.hi[i], i in executions.chosen, finest[i])
            for i, e in enumerate(edges)
        ]
        n_bins = math.prod(1 if a.edges is None else len(a.edges) - 1 for a in axes)
        if n_bins <= MOST or coarse > COARSEST:
            return axes
        coarse *= 1.25


def widest(values: np.ndarray, grid: tuple[int, ...], axes: list[Axis]) -> np.ndarray:
    """(new bins, ...) the largest of values (old bins, ...) over the bins that are met."""
    rest = values.shape[1:]
    out = values.reshape(*grid, *rest)
    for place, axis in enumerate(axes):
        parts = [np.take(out, np.arange(a, b + 1), axis=place).max(axis=place) for a, b in axis.met]
        out = np.stack(parts, axis=place)
    return out.reshape(-1, *rest)


def boxes(axes: list[Axis], executions: Executions) -> tuple[np.ndarray, np.ndarray]:
    """Corners lo, hi (new bins, n_k) of all k that the executions of a bin's plans may have."""
    ends = []
    for i, axis in enumerate(axes):
        low, high = executions.lo[i], executions.hi[i]
        if axis.edges is None:
            ends.append([(low, high)])
        else:
            pairs = itertools.pairwise(axis.edges)
            ends.append([(a + low, b + high) for a, b in pairs])
    places = np.meshgrid(*(np.arange(len(e)) for e in ends), indexing="ij")
    picked = [np.array(e)[place.ravel()] for e, place in zip(ends, places, strict=True)]
    both = np.stack(picked, axis=1)
    return both[:, :, 0], both[:, :, 1]
