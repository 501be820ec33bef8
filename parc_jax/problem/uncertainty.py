"""Uncertainty in the execution of a plan: measured poses, execution errors, measured obstacles and
goals, parameters that no plan chooses. [T21, T22]
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from parc_jax.common.arrays import NO_NUMBER
from parc_jax.common.errors import InputError, shown
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope, owned
from parc_jax.learning.bound.counts import as_fraction
from parc_jax.learning.system import LARGEST

Parameter = str | int  # a name of a parameter, or its number from 0
Interval = tuple[float, float]
FREE = "free"  # in place of the value of a given parameter: plans choose it nevertheless


class Each(tuple):
    """Pairs (number, value) of a list: of every parameter of the robot."""


@dataclass(frozen=True)
class Uncertainty:
    """Uncertainty that a safe plan is robust to: `reach_avoid(..., uncertainty=Uncertainty(...))`.
    By default all is exact. Raises InputError.
    """

    # more types are accepted than stored: tuples of floats, of pairs (name, value), of sets
    start: Any = ()
    """Half widths [m] of a box around the start, which holds the true one: one number, or one per
    axis."""
    heading: float = 0.0
    """Half angle [rad] around the heading at the start, below 1; the system must declare rotation
    invariance."""
    k: Any = ()
    """Half widths of execution errors of parameters: (n_k,), or by name, in the shell speed=0.1;
    added to the box of a parameter that is also given or unknown."""
    goal: Any = ()
    """Half widths [m, .] of the error of the measured goal: one number, one per axis, or with those
    of q."""
    obstacles: Any = ()
    """Polytope of the error of measured obstacles (true place = measured place + a point of it):
    one for all, or one for each, None for an exact one."""
    given: Any = ()
    """Parameters that are measured and not chosen, by name: a number, or its lowest and highest
    value, in the shell speed=9.2 load=1:2; "free" for one that a system measures at the start and a
    plan chooses nevertheless."""
    unknown: Any = ()
    """Parameters that are neither chosen nor measured, by name: their lowest and highest value, in
    the shell wind=-1:1; a plan is safe for all of it."""
    sensing_eps: Any = 0
    """Probability that a true value lies outside of these boxes."""

    def __post_init__(self) -> None:
        for name, valid in _VALID.items():
            object.__setattr__(self, name, valid(f"uncertainty {name}", getattr(self, name)))

    @property
    def is_nothing(self) -> bool:
        """All is exact: the problem is its own nominal problem."""
        wide = [*self.start, *self.goal, *(width for _, width in self.k), self.heading]
        exact = all(s is None for s in self.obstacles)
        fixed = [value for _, value in self.given if value != FREE]
        return not any([*wide, *fixed, *self.unknown, self.sensing_eps]) and exact

    @property
    def of_model(self) -> tuple:
        """The fields that change the model: equal for uncertainties that share a robust model."""
        return self.start, self.heading, self.k, self.given, self.unknown

    def shifts(self, n: int) -> np.ndarray:
        """(n,) half widths of the start. Raises InputError."""
        return _fitted("uncertainty start", self.start, n, "one per axis of the workspace")

    def of_goal(self, n_p: int, n_q: int) -> np.ndarray:
        """(n_p + n_q,) half widths of the goal. Raises InputError."""
        if n_q and len(self.goal) == n_p + n_q:  # else that of q is exact
            return np.array(self.goal)
        return np.concatenate(
            [_fitted("uncertainty goal", self.goal, n_p, "one per axis, or with q"), np.zeros(n_q)]
        )

    def of_obstacles(self, n: int) -> tuple[HPolytope | None, ...]:
        """The error set of each of n obstacles, None for exact ones. Raises InputError."""
        if len(self.obstacles) <= 1:
            return (self.obstacles or (None,)) * n
        if len(self.obstacles) != n:
            raise InputError(
                f"uncertainty obstacles: expected one set for all or one for each of {n}; got "
                f"{len(self.obstacles)}."
            )
        return self.obstacles


def _widths(name: str, value, n: int | None = None) -> tuple[float, ...]:
    """Half widths >= 0; one number alone is a tuple of one."""
    try:
        if np.asarray(value).dtype == bool:
            raise TypeError
        array = np.atleast_1d(np.asarray(value, np.float64))
    except NO_NUMBER:
        raise InputError(f"{name}: expected half widths, numbers; got {shown(value)}.") from None
    fits = (array == 0) | ((1 / LARGEST <= array) & (array <= LARGEST))
    if array.ndim != 1 or n not in (None, len(array)) or not fits.all():
        raise InputError(
            f"{name}: expected finite half widths >= 0, none between 0 and {1 / LARGEST:g}; got "
            f"{value!r:.60}."
        )
    return tuple(array.tolist())


def _fitted(name: str, widths: tuple[float, ...], n: int, meaning: str) -> np.ndarray:
    if len(widths) <= 1:
        return np.full(n, widths[0] if widths else 0.0)
    if len(widths) != n:
        raise InputError(f"{name}: expected one half width, or {n}, {meaning}; got {len(widths)}.")
    return np.array(widths)


def _by_name(read: Callable, listed: bool = False) -> Callable:
    """A reader, values by `read`, of a mapping, pairs or, if `listed`, a list; each name once."""

    def valid(name: str, given) -> tuple:
        if isinstance(given, Mapping):
            pairs: Sequence = list(given.items())
        elif isinstance(given, tuple) and all(isinstance(e, tuple) and len(e) == 2 for e in given):
            pairs = given  # as it is stored
        elif listed and not isinstance(given, str) and np.ndim(given) == 1:
            pairs = Each(enumerate(given))
        else:
            example = ' such as {"speed": ...}'
            raise InputError(f"{name}: expected parameters by name,{example}; got {given!r:.60}.")
        named = [(_parameter(name, p), value) for p, value in pairs]
        names = [p for p, _ in named]
        if twice := [p for p in names if names.count(p) > 1]:
            raise InputError(f"{name}: expected every parameter once; {twice[0]} is named twice.")
        kind = Each if isinstance(pairs, Each) else tuple
        return kind((p, read(f"{name} of {p}", value)) for p, value in named)

    return valid


def _parameter(name: str, given) -> Parameter:
    """A name, or a number, which may be text."""
    if isinstance(given, str):
        return int(given) if given.isdecimal() else given
    if isinstance(given, int | np.integer) and not isinstance(given, bool):
        return int(given)
    raise InputError(f"{name}: expected parameters by name or number from 0; got {given!r:.60}.")


def _value_or_box(name: str, value) -> Interval | str:
    if isinstance(value, str) and value == FREE:
        return FREE
    single = np.ndim(value) == 0 and not isinstance(value, str) and value is not None
    return _box(name, (value, value) if single else value)


def _box(name: str, value) -> Interval:
    try:
        lo, hi = (float(x) for x in value)
    except NO_NUMBER:
        raise InputError(f"{name}: expected a box (lo, hi); got {shown(value)}.") from None
    if not (math.isfinite(lo) and math.isfinite(hi) and lo <= hi):
        raise InputError(f"{name}: expected a box lo <= hi of finite numbers; got ({lo}, {hi}).")
    return lo, hi


def _heading(name: str, value) -> float:
    angle = _widths(name, value, 1)[0]
    if angle >= 1:
        raise InputError(f"{name}: expected a half angle below 1 rad; got {angle:g}.")
    return angle


def _sets(name: str, value) -> tuple[HPolytope | None, ...]:
    one = isinstance(value, Box | HPolytope) or not np.iterable(value)
    sets = [value] if one else list(value)
    of = "uncertainty of obstacle"
    return tuple(None if s is None else owned(s, f"{of} {i}") for i, s in enumerate(sets))


def _probability(name: str, value) -> Fraction:
    if not 0 <= (exact := as_fraction(name, value)) < 1:
        raise InputError(f"{name}: expected a probability in [0, 1); got {value!r:.60}.")
    return exact


_VALID = {
    "start": _widths,
    "heading": _heading,
    "k": _by_name(lambda name, value: _widths(name, value, 1)[0], listed=True),
    "goal": _widths,
    "obstacles": _sets,
    "given": _by_name(_value_or_box),
    "unknown": _by_name(_box),
    "sensing_eps": _probability,
}
