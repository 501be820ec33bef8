"""Runs that are the same run twice: equal up to what storage and printing do to numbers."""

from typing import NamedTuple

import numpy as np

from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.runs.batch import RolloutBatch

_TIMES = 8  # records of a run that are compared
# With two independent uniform draws per pair, more pairs than these have at most this probability
# of being near each other by chance.
_CHANCE = 1e-3


class Marks(NamedTuple):
    """What two runs are compared by: k (n, n_k), and path (n, m): p at a few records, then q."""

    k: np.ndarray
    path: np.ndarray

    def select(self, index) -> "Marks":
        """The marks of some runs."""
        return Marks(self.k[index], self.path[index])


def marks_of(batch: RolloutBatch) -> Marks:
    """The marks of every run of a batch."""
    records = np.unique(np.linspace(0, batch.time.n_record, _TIMES + 1).astype(int)[1:])
    path = np.asarray(batch.p[:, records], np.float64).reshape(batch.n, -1)
    return Marks(np.asarray(batch.k), np.concatenate([path, np.asarray(batch.q)], axis=1))


def near_copies(one: Marks, other: Marks | None, width: np.ndarray) -> np.ndarray:
    """Pairs (m, 2) of rows, of `one` and of `other` (None = of `one` again), that are the same run
    but for `TOLERANCES.near_k` and `near_p`. Failed runs are not compared.

    width: (n_k,) of K. None when there are no more pairs than chance explains for k drawn uniformly
    by a system without disturbance.
    """
    from scipy.spatial import cKDTree
    from scipy.stats import poisson

    both = one if other is None else Marks(*map(np.concatenate, zip(one, other, strict=True)))
    finite = np.isfinite(both.path).all(axis=1)
    size = np.abs(both.path[finite]).max(axis=0, initial=0.0)
    ours, first = _scaled(one, width, size)
    if other is None:
        pairs = cKDTree(ours).query_pairs(1.0, p=np.inf, output_type="ndarray")
        tried = len(ours) * (len(ours) - 1) / 2
        pairs = np.sort(first[pairs.reshape(-1, 2)], axis=1)
    else:
        theirs, second = _scaled(other, width, size)
        near = (
            cKDTree(theirs).query(ours, p=np.inf, distance_upper_bound=1.0)[1]
            if len(theirs)
            else []
        )
        hit = np.flatnonzero(np.asarray(near, int) < len(theirs))
        pairs = np.stack([first[hit], second[np.asarray(near, int)[hit]]], axis=1)
        tried = len(ours) * len(theirs)
    by_chance = tried * float(np.prod(np.full(len(width), 2 * TOLERANCES.near_k)))
    pairs = pairs[np.lexsort(pairs.T[::-1])]
    return pairs if len(pairs) > poisson.isf(_CHANCE, by_chance) else pairs[:0]


def _scaled(marks: Marks, width, size) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates in which a copy lies within one, and the rows that they belong to."""
    rows = np.flatnonzero(np.isfinite(marks.path).all(axis=1))
    k = marks.k[rows] / (TOLERANCES.near_k * np.where(width > 0, width, 1.0))
    path = marks.path[rows] / (TOLERANCES.near_p * np.where(size > 0, size, 1.0))
    return np.concatenate([k, path], axis=1), rows
