"""What the robot may do between two records: declared, or declared to be nothing. [T9]"""

import ast
import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from parc_jax.common.errors import InputError


@dataclass(frozen=True)
class DiscreteTime:
    """The system is declared to exist at its record times only; nothing is added."""

    def term(self, h: float, n_p: int, n_points: int = 1) -> np.ndarray:
        """(n_points n_p,) [m] to add to interval errors; h: record step [s]."""
        return np.zeros(n_points * n_p)

    def assumption(self, h: float) -> str:
        """Identifier for the ledger."""
        return f"DISCRETE_TIME(h = {h:g} s)"


@dataclass(frozen=True)
class SpeedBound:
    """Declared: |velocity| <= v [m/s] per axis (a number, or one per axis, for every reference
    point) at all times. Adds v h / 2. [T9]
    """

    v: float | tuple[float, ...]

    def term(self, h: float, n_p: int, n_points: int = 1) -> np.ndarray:
        """(n_points n_p,) [m] to add to interval errors; h: record step [s]."""
        return _per_column("speed bound", self.v, n_p, n_points) * (0.5 * h) * _UP

    def assumption(self, h: float) -> str:
        """Identifier for the ledger."""
        return f"INTERSAMPLE(speed <= {self.v} m/s, h = {h:g} s)"


@dataclass(frozen=True)
class AccelerationBound:
    """Declared: |acceleration| <= a [m/s^2] per axis (a number, or one per axis, for every
    reference point) at all times. Adds a h^2 / 8. [T9]
    """

    a: float | tuple[float, ...]

    def term(self, h: float, n_p: int, n_points: int = 1) -> np.ndarray:
        """(n_points n_p,) [m] to add to interval errors; h: record step [s]."""
        return _per_column("acceleration bound", self.a, n_p, n_points) * (h * h / 8) * _UP

    def assumption(self, h: float) -> str:
        """Identifier for the ledger."""
        return f"INTERSAMPLE(acceleration <= {self.a} m/s^2, h = {h:g} s)"


def intersample_of(assumptions: Iterable[str]) -> DiscreteTime | SpeedBound | AccelerationBound:
    """The declaration that a ledger names, as the records below spell it."""
    for entry in assumptions:
        bound = re.match(r"INTERSAMPLE\((speed|acceleration) <= (.*) m/s(\^2)?, h = ", entry)
        if bound:
            value = ast.literal_eval(bound[2])
            return SpeedBound(value) if bound[1] == "speed" else AccelerationBound(value)
    return DISCRETE_TIME


_UP = 1 + 2.0**-50  # a few roundings, upward


def _per_column(name: str, value: npt.ArrayLike, n_p: int, n_points: int) -> np.ndarray:
    bound = np.asarray(value, np.float64)
    if bound.shape not in ((), (n_p,)) or not (np.isfinite(bound) & (bound >= 0)).all():
        raise InputError(f"{name}: expected one number >= 0, or {n_p} of them; got {value}.")
    return np.tile(np.broadcast_to(bound, (n_p,)), n_points)


DISCRETE_TIME = DiscreteTime()
