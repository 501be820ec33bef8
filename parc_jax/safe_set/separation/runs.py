"""Directions over time as runs: few words for a certificate. [T14]"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from parc_jax.safe_set.separation.directions import Multiplier


class Run(NamedTuple):
    """A direction that separates one obstacle from interval `first` up to, not including, `end`."""

    first: int
    end: int
    multiplier: Multiplier


def merged_runs(multipliers: Iterable[Multiplier], intervals: Iterable[int]) -> list[Run]:
    """Runs of one and the same multiplier over consecutive intervals."""
    runs: list[Run] = []
    for m, t in zip(multipliers, intervals, strict=True):
        if runs and runs[-1].multiplier is m:
            runs[-1] = runs[-1]._replace(end=int(t) + 1)
        else:
            runs.append(Run(int(t), int(t) + 1, m))
    return runs


def longest_lasting(holds: np.ndarray) -> np.ndarray:
    """holds (d, T) -> (T,): a direction kept until it fails, then the one that lasts longest; -1
    where none holds. So few runs as can be.
    """
    n_steps = holds.shape[1]
    length = np.zeros((len(holds), n_steps + 1), int)
    for t in range(n_steps - 1, -1, -1):
        length[:, t] = np.where(holds[:, t], 1 + length[:, t + 1], 0)
    out = np.full(n_steps, -1)
    current = -1
    for t in range(n_steps):
        if current < 0 or not holds[current, t]:
            current = int(np.argmax(length[:, t])) if holds[:, t].any() else -1
        out[t] = current
    return out
