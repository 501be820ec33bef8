"""The executions that stand for all of them: corners of the box in which k is executed. [T21]

In between, the network is the same mixture of what it says at the corners, but for its kinks
(`bend`).
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import round_down, round_up
from parc_jax.common.spelling import listed
from parc_jax.learning.labels import name_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.uncertainty import FREE, Interval, Uncertainty, require_once

MOST = 64  # reference points that the checker takes, each execution with its own


class Parameter(NamedTuple):
    """What is known of one parameter when a plan is driven: the one record from which it is solved
    and told.

    known: what was "measured", or is "unknown", within value; None of one that a plan chooses. off:
    half width by which it is executed wrongly.
    """

    name: str
    known: str | None
    value: Interval
    off: float

    @property
    def box(self) -> Interval:
        """What an execution adds to a plan that chooses it, or the values that it has; rounded
        outward.
        """
        (lo, hi), off = self.value, Fraction(self.off)
        return round_down(Fraction(lo) - off), round_up(Fraction(hi) + off)

    @property
    def words(self) -> str:
        """Of one that is known: "every load from 1 to 2 (measured)"."""
        lo, hi = self.value
        if not self.off and lo == hi:
            return f"{self.name} = {told(lo)} ({self.known})"
        values = told(lo) if lo == hi else f"what is from {told(lo)} to {told(hi)}"
        if self.off:
            off = told(self.off)
            return f"every {self.name} within ±{off} of {values} ({self.known}, executed roughly)"
        return f"every {self.name} from {told(lo)} to {told(hi)} ({self.known})"


@dataclass(frozen=True, eq=False)
class Executions:
    """How plans are executed: what is known of each parameter, in the order of k."""

    parameters: tuple[Parameter, ...]

    @cached_property
    def chosen(self) -> tuple[int, ...]:
        """Axes of k that a plan still chooses."""
        return tuple(axis for axis, p in enumerate(self.parameters) if p.known is None)

    @cached_property
    def lo(self) -> np.ndarray:
        """(n_k,) least that an execution adds on the chosen axes, least values of the others."""
        return np.array([p.box[0] for p in self.parameters])

    @cached_property
    def hi(self) -> np.ndarray:
        """(n_k,) the most."""
        return np.array([p.box[1] for p in self.parameters])

    @property
    def plain(self) -> bool:
        """Everything is chosen, and executed as it is."""
        return not any(p.known or p.off for p in self.parameters)

    @property
    def exact(self) -> bool:
        """There is one execution: what is not chosen is known, and all is executed as it is."""
        return bool((self.lo == self.hi).all())

    def whole(self, k: np.ndarray) -> np.ndarray:
        """(n, n_k) all parameters of plans that choose k (n, chosen), where there is one
        execution.
        """
        out = np.tile(self.lo, (len(k), 1))
        out[:, list(self.chosen)] = k
        return out

    @property
    def widths(self) -> np.ndarray:
        """(n_k,) full widths of the box, rounded up."""
        return np.where(self.hi > self.lo, np.nextafter(self.hi - self.lo, np.inf), 0.0)

    @cached_property
    def corners(self) -> np.ndarray:
        """(V, n_k) corners of the box; an axis without width has one end."""
        ends = [(a,) if a == b else (a, b) for a, b in zip(self.lo, self.hi, strict=True)]
        return np.array(list(itertools.product(*ends)))

    @property
    def words(self) -> tuple[list[str], list[str]]:
        """What is executed roughly, and what is known of parameters that no plan chooses."""
        of_chosen = [p for p in self.parameters if p.known is None and p.off]
        off = ", ".join(f"{p.name} off by up to {told(p.off)}" for p in of_chosen)
        known = [p.words for p in self.parameters if p.known is not None]
        return [f"every execution with {off}"] if off else [], known


def executions_of(uncertainty: Uncertainty, model: TrajectoryModel) -> Executions:
    """Of an uncertainty about plans of this model. Raises InputError for parameters that there are
    not or that are named twice, or boxes outside of K.
    """
    names = [name_of(label) for label in model.labels.k]
    off = _by_axis("uncertainty k", uncertainty.k, names)
    given = _by_axis("uncertainty given", uncertainty.given, names)
    given = {axis: value for axis, value in given.items() if value != FREE}
    unknown = _by_axis("uncertainty unknown", uncertainty.unknown, names)
    for axis in given.keys() & unknown.keys():
        raise InputError(
            f"uncertainty: expected a parameter to be given or unknown; {names[axis]} is both."
        )
    parameters = []
    for axis, name in enumerate(names):
        known = "measured" if axis in given else "unknown" if axis in unknown else None
        value = (given | unknown).get(axis, (0.0, 0.0))
        parameters.append(Parameter(name, known, value, off.get(axis, 0.0)))
        _require_inside(parameters[-1], model.domain.lo[axis], model.domain.hi[axis])
    if all(p.known for p in parameters):
        raise InputError("uncertainty: expected at least one parameter to choose; all are given.")
    return Executions(tuple(parameters))


def require_given(uncertainty: Uncertainty | None, model: TrajectoryModel) -> None:
    """Refuse a question that leaves open what the model's system measures at the start: no plan
    chooses it, unless it is said to be free. [T37] Raises InputError.
    """
    names = [name_of(label) for label in model.labels.k]
    said: set[int] = set()
    if uncertainty is not None:
        for word in ("given", "unknown"):
            said |= _by_axis(f"uncertainty {word}", getattr(uncertainty, word), names).keys()
    missing = [names[axis] for axis in model.given if axis not in said]
    if missing:
        raise InputError(
            f"uncertainty given: expected {listed(missing)}, which {model.system or 'this robot'} "
            f"measures at the start; got no value. Say "
            f"Uncertainty(given={{{missing[0]!r}: 0.5}}), or "
            f'"{FREE}" in place of a value to look for starts too.'
        )


def told(x: float) -> str:
    """The shortest decimal that this float alone is read from."""
    return repr(float(x)).removesuffix(".0")


def require_few(points: int, executions: int) -> None:
    """Raises InputError for more points than a certificate may have."""
    if points * executions > MOST:
        raise InputError(
            f"uncertainty: expected at most {MOST} reference points, each with all its "
            f"executions; got {points} with {executions}. Bound the uncertainty of fewer "
            "parameters, or use fewer points."
        )


def _by_axis(word: str, pairs: tuple, names: Sequence[str]) -> dict:
    """What is said of parameters, by axis of k."""
    axes = []
    for name, _ in pairs:
        plain = name_of(name) if isinstance(name, str) else name
        axis = names.index(plain) if plain in names else name
        if not (isinstance(axis, int) and 0 <= axis < len(names)):
            raise InputError(
                f"{word}: expected parameters of the model ({', '.join(names)}); got {name!r}."
            )
        axes.append(axis)
    require_once(word, [names[axis] for axis in axes])
    return {axis: value for axis, (_, value) in zip(axes, pairs, strict=True)}


def _require_inside(p: Parameter, lo: float, hi: float) -> None:
    """Raises InputError for executions that leave K, which is [lo, hi] here."""
    low, high = p.box
    if p.known is None and 2 * p.off >= hi - lo:
        raise InputError(
            f"uncertainty k of {p.name}: expected less than half of the range of K, "
            f"{(hi - lo) / 2:g}; got {p.off:g}."
        )
    if p.known is not None and not (lo <= low and high <= hi):
        rough = f", executed within ±{told(p.off)}" if p.off else ""
        value = ", ".join(told(x) for x in p.value)
        raise InputError(
            f"uncertainty of {p.name}: expected a box within K, [{lo:g}, {hi:g}]; got [{value}] "
            f"({p.known}{rough}). Narrow it, or learn a model of more."
        )
