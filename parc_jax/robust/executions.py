"""The executions that stand for all of them: corners of the box in which k is executed. [T21]

In between, the network is the same mixture of what it says at the corners, but for its kinks
(`bend`).
"""

import itertools
from typing import NamedTuple

import numpy as np

from parc_jax.doubt import Doubt
from parc_jax.errors import InputError
from parc_jax.labels import name_of
from parc_jax.model import TrajectoryModel
from parc_jax.sets.box import Box

MOST = 64  # reference points that the checker takes, each execution with its own


class Executions(NamedTuple):
    """chosen: axes of k that a plan still chooses. lo, hi (n_k,): what an execution adds to a plan
    on its chosen axes, and the values of the others.
    """

    chosen: tuple[int, ...]
    lo: np.ndarray
    hi: np.ndarray

    @property
    def plain(self) -> bool:
        """Everything is chosen, and executed as it is."""
        return len(self.chosen) == len(self.lo) and not (self.lo.any() or self.hi.any())

    @property
    def widths(self) -> np.ndarray:
        """(n_k,) full widths of the box, rounded up."""
        return np.where(self.hi > self.lo, np.nextafter(self.hi - self.lo, np.inf), 0.0)

    @property
    def corners(self) -> np.ndarray:
        """(V, n_k) corners of the box; an axis without width has one end."""
        ends = [(a,) if a == b else (a, b) for a, b in zip(self.lo, self.hi, strict=True)]
        return np.array(list(itertools.product(*ends)))


def executions_of(doubt: Doubt, model: TrajectoryModel) -> Executions:
    """Of a doubt about plans of this model. Raises InputError for parameters that there are not, or
    boxes outside of K.
    """
    n_k = model.n_k
    lo, hi = np.zeros(n_k), np.zeros(n_k)
    seen: dict[int, str] = {}
    for word, pairs in (("k", doubt.k), ("given", doubt.given), ("unknown", doubt.unknown)):
        for name, value in pairs:
            axis = _axis(name, model, word)
            if axis in seen and (word != "k" and seen[axis] != "k"):
                raise InputError(f"doubt: expected a parameter once; {name} is in it twice.")
            seen[axis] = word
            if word == "k":
                lo[axis], hi[axis] = -value, value
            else:
                _require_inside(word, name, value, model.domain, axis)
                lo[axis], hi[axis] = value
    chosen = tuple(axis for axis in range(n_k) if seen.get(axis, "k") == "k")
    if not chosen:
        raise InputError("doubt: expected at least one parameter to choose; all are given.")
    wide = model.domain.hi - model.domain.lo
    for axis in chosen:
        if 2 * hi[axis] >= wide[axis]:
            raise InputError(
                f"doubt k of {name_of(model.labels.k[axis])}: expected less than half of the range "
                f"of K, {wide[axis] / 2:g}; got {hi[axis]:g}."
            )
    return Executions(chosen, lo, hi)


def require_few(points: int, executions: int) -> None:
    """Raises InputError for more points than a certificate may have."""
    if points * executions > MOST:
        raise InputError(
            f"doubt: expected at most {MOST} reference points, each with all its executions; got "
            f"{points} with {executions}. Bound the doubt of fewer parameters, or use fewer points."
        )


def _axis(name, model: TrajectoryModel, word: str) -> int:
    names = [name_of(label) for label in model.labels.k]
    if isinstance(name, str) and name in names:
        return names.index(name)
    if not isinstance(name, str) and 0 <= name < model.n_k:
        return int(name)
    raise InputError(
        f"doubt {word}: expected parameters of the model ({', '.join(names)}); got {name!r}."
    )


def _require_inside(word: str, name, value, domain: Box, axis: int) -> None:
    lo, hi = value
    if not (domain.lo[axis] <= lo and hi <= domain.hi[axis]):
        raise InputError(
            f"doubt {word} of {name}: expected a box within K, [{domain.lo[axis]:g}, "
            f"{domain.hi[axis]:g}]; got [{lo:g}, {hi:g}]."
        )
