"""Settings of error bounds: probabilities, runs, shapes, and the time between records. [T9]"""

import ast
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal

import numpy as np

from parc_jax.common.errors import InputError, check_count
from parc_jax.common.options import Options
from parc_jax.common.spelling import exact, rounded_up
from parc_jax.learning.bound.counts import MOST, as_probability
from parc_jax.learning.bound.profile import SHAPES

_UP = 1 + 2.0**-50  # a few roundings, upward


@dataclass(frozen=True)
class DiscreteTime:
    """The system is declared to exist at its record times only; nothing is added."""

    def term(self, h: float, n_p: int, n_points: int = 1) -> np.ndarray:
        """(n_points n_p,) [m] to add to interval errors; h: record step [s]."""
        return np.zeros(n_points * n_p)

    def assumption(self, h: float) -> str:
        """Identifier for the ledger."""
        return f"DISCRETE_TIME(h = {exact(h)} s)"


class Bounded:
    """A derivative of all places, bounded at all times: a number, or one per axis, for every
    reference point. Differences of records, of this order, are at most bound x h^order.
    """

    order: int
    parts: int
    word: str
    unit: str

    def most(self, h: float, n_p: int, n_points: int = 1) -> np.ndarray:
        """(n_points n_p,) [m] largest difference of records. h: record step [s]."""
        (value,) = vars(self).values()
        bound = np.asarray(value, np.float64)
        if bound.shape not in ((), (n_p,)) or not (np.isfinite(bound) & (bound >= 0)).all():
            raise InputError(f"{self.word} bound: expected 1 or {n_p} numbers >= 0; got {value}.")
        return np.tile(np.broadcast_to(bound, (n_p,)), n_points) * h**self.order

    def term(self, h: float, n_p: int, n_points: int = 1) -> np.ndarray:
        """(n_points n_p,) [m] to add to interval errors; h: record step [s]."""
        return self.most(h, n_p, n_points) / self.parts * _UP

    def assumption(self, h: float) -> str:
        """Identifier for the ledger."""
        (value,) = vars(self).values()
        plain = np.asarray(value, float).tolist()  # checkers read the numbers
        plain = tuple(plain) if isinstance(plain, list) else plain
        return f"INTERSAMPLE({self.word} <= {plain} {self.unit}, h = {exact(h)} s)"


@dataclass(frozen=True)
class SpeedBound(Bounded):
    """Declared: |velocity| <= v [m/s], a number or one per axis. Adds v h / 2. [T9]"""

    v: float | tuple[float, ...]
    # a place between two records is at most h / 2 from the nearer one
    order, parts, word, unit = 1, 2, "speed", "m/s"


@dataclass(frozen=True)
class AccelerationBound(Bounded):
    """Declared: |acceleration| <= a [m/s^2], a number or one per axis. Adds a h^2 / 8. [T9]"""

    a: float | tuple[float, ...]
    # error of linear interpolation: max of s (h - s) / 2 over the step
    order, parts, word, unit = 2, 8, "acceleration", "m/s^2"


Intersample = DiscreteTime | SpeedBound | AccelerationBound
DISCRETE_TIME = DiscreteTime()


def check_between(between: Intersample, runs: Any, moves: np.ndarray) -> None:
    """Refuse runs, a batch or `Scores`, whose records refute the bound on their motion. moves: as
    of `moves_of`. Raises InputError. [T9]
    """
    if not isinstance(between, Bounded):
        return
    if "records" in (how := runs.law.cut):  # those of bags and tracks are made between places
        told = f"{runs.law.generator}: expected records of where it was, for a bound on its motion"
        raise InputError(f"{told} between them; got {how['records']}. Claim without that bound.")
    about, moved = runs.subject, moves[:, between.order - 1]
    h = about.time.dt_record
    over = (moved > between.most(h, about.n_p, len(about.points))).any(axis=1)
    if over.any():
        needed = rounded_up(float(moved[over][0].max() / h**between.order), 3)
        raise InputError(
            f"{runs.law.generator}: expected runs that keep to {between.assumption(h)}, as "
            f"declared; the records of row {runs.rows[over][0]} need {needed} {between.unit}. "
            "Declare what holds."
        )


def intersample_of(assumptions: Iterable[str]) -> Intersample:
    """The declaration in a ledger, inverse of `assumption`."""
    for entry in assumptions:
        bound = re.match(r"INTERSAMPLE\((speed|acceleration) <= (.*) m/s(\^2)?, h = ", entry)
        if bound:
            value = ast.literal_eval(bound[2])
            return SpeedBound(value) if bound[1] == "speed" else AccelerationBound(value)
    return DISCRETE_TIME


CLAIMS = ("one", "bins")
GAP = 1e-5  # [m or rad] that the start of a run may matter, unless declared otherwise


@dataclass(frozen=True)
class Sizing(Options):
    """Size of a tube, for claims about the whole of K or a part of it."""

    shape: str = "box"
    """Shape of the tube: "box", half widths along the axes; "signed", the same about the middle of
    the errors; or "fitted", faces along their principal axes beside these. [T26]"""
    eps: float | Fraction = 1e-3
    """Probability with which a new run may leave the tube."""
    fresh: int | None = None
    """Runs behind the claims. Default: as many as they need."""
    discard: int | Literal["most"] = MOST
    """Runs to leave outside of the tube, fixed before any is seen; "most": as many as eps and delta
    allow; with a number, such as 0, the claims carry the eps that the runs support."""
    profile_runs: int | None = None
    """Runs beside the training ones from which the tube's profile is learnt, which is where
    tightness comes from; the network does not see them. Default: as many as the fresh runs."""
    gap: float = GAP
    """Most that the start of a run may matter [m or rad]. It is tried from a few starts, a larger
    effect is refused, and the tube is widened by it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        as_probability("eps", self.eps)
        if self.shape not in SHAPES:
            raise InputError(f"shape: expected one of {', '.join(SHAPES)}; got {self.shape!r}.")
        if self.discard != MOST:
            hint = f'0, or "{MOST}" where eps and delta decide'
            check_count("discard", self.discard, 0, hint)
        if self.fresh is not None:
            check_count("fresh", self.fresh, 1, "None for as many as the claims need")
        if self.profile_runs is not None:
            check_count("profile_runs", self.profile_runs, 0, "0 for the training runs alone")
        check_gap(self.gap)


@dataclass(frozen=True)
class ModelBound(Sizing):
    """The bound of a model's error over the whole of K."""

    profile_runs: int | None = 0
    delta: float | Fraction = 1e-3
    """One minus the confidence in eps, for all networks and claims at once."""
    bins: tuple[int, ...] | tuple[np.ndarray, ...] | None = None
    """Bins per axis of K over which the tube's profile varies; in Python also their edges per axis.
    Default: cut where the error of the first network changes."""
    blocks: tuple[int, ...] | None = None
    """Claims per axis of K, each about a block of neighbouring bins: a profile in fine bins, claims
    in coarse ones [T4]. Default: one claim over K; every bin, where claims by "bins" are named."""

    def __post_init__(self) -> None:
        super().__post_init__()
        as_probability("delta", self.delta)


@dataclass(frozen=True)
class BoundSettings(ModelBound):
    """Claims about some networks, from the same fresh runs."""

    profile_runs: int | None = None
    claims: tuple[str, ...] = ("one",)
    """"one" over all of K [T1, T2], "bins" in every bin or block at once [T4]; the first one is
    returned by `bound_error`."""
    looks: int = 1
    """Uses of the fresh runs beyond the networks and claims of one call."""
    intersample: Intersample = DISCRETE_TIME
    """Motion between records. [T9]"""

    def __post_init__(self) -> None:
        super().__post_init__()
        kinds = set(self.claims)
        if not kinds or len(kinds) < len(self.claims) or kinds - set(CLAIMS):
            raise InputError(
                f"claims: expected some of {', '.join(CLAIMS)}, each once; got {self.claims}."
            )
        check_count("looks", self.looks, 1, "1 for a holdout that is used once")


def check_gap(gap: float) -> None:
    """Refuse a negative or infinite gap. Raises InputError."""
    if not 0 <= gap < math.inf:
        raise InputError(
            f"gap: expected how much the start may matter, a number >= 0 [m or rad]; got {gap}."
        )
