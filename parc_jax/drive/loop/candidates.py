"""Candidates of a loop: measured and chosen parameters, their predictions, rest at the end.

A candidate's given parameters are measured, or are the command that is under way [T39]; the others
are chosen. Predictions order candidates and decide nothing. That a robot rests at the end of its
manoeuvres is assumed; `require_rest` may refute it and proves nothing. [T38]
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike
from scipy.stats import qmc

from parc_jax.common.arrays import as_float64, slices
from parc_jax.common.errors import InputError
from parc_jax.common.spelling import listed
from parc_jax.drive.loop.commitment import SAME, Commitment, turned
from parc_jax.learning.labels import axes_of, name_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import trajectories
from parc_jax.learning.network.relu import outputs
from parc_jax.learning.system import TURNS
from parc_jax.learning.systems.chained import hand_over_of
from parc_jax.problem.robust.pose import Pose

AT_ONCE = 64  # candidates predicted at a time
SAMPLED = 10  # 2 to the power of so many k, even over K, are tried for rest ...
CORNERS = 10  # ... and the corners of K, up to so many parameters
ROUNDED = 1e-9  # [m] more than networks round by: a model that moves so little more is believed


def given_axes(model: TrajectoryModel, given: Sequence[str | int] | None) -> tuple[int, ...]:
    """Indices of the given parameters: all that the system declares, by default these alone. Where
    the claim rests on runs no others: their start is hidden in those. [T37] Raises InputError.
    """
    names = [name_of(label) for label in model.labels.k]
    given = model.given if given is None else given
    if not np.iterable(given):
        raise InputError(f"given: expected a list of parameters; got {given!r:.60}.")
    axes = axes_of(given, model.labels.k)
    if axes is None:
        raise InputError(
            f"given: expected parameters of the model, each once "
            f"({', '.join(model.labels.k)}); got {given!r:.60}."
        )
    if len(axes) == model.n_k:
        raise InputError("given: expected at least one parameter to choose; all are given.")
    measured = [names[axis] for axis in model.given]
    if not set(model.given) <= set(axes):
        raise InputError(
            f"given: expected {listed(measured)}, all that {model.system or 'the robot'} measures "
            f"at the start; got {given!r:.200}. What is measured is not chosen."
        )
    others = [names[axis] for axis in axes if axis not in model.given]
    if others and model.claim.kind == "pac":
        raise InputError(
            f"given: expected what the runs of the claim measured at the start; the system does "
            f"not declare {listed(others)}. Declare `given` there and calibrate anew: then the "
            "claim lists HIDDEN_START."
        )
    return axes


def even_candidates(model: TrajectoryModel, given: tuple[int, ...], n: int) -> np.ndarray:
    """(n, n_k) even over the chosen parameters, none of them on an edge between bins."""
    chosen = [axis for axis in range(model.n_k) if axis not in given]
    share = qmc.Sobol(len(chosen), seed=0).random_base2(int(np.ceil(np.log2(n))))[:n]
    lo, hi = model.domain.lo[chosen], model.domain.hi[chosen]
    return listed_candidates(model, given, lo + share * (hi - lo))


def listed_candidates(
    model: TrajectoryModel, given: tuple[int, ...], values: ArrayLike
) -> np.ndarray:
    """(b, n_k) of values of the chosen parameters alone. Raises InputError."""
    chosen = [axis for axis in range(model.n_k) if axis not in given]
    values = as_float64("candidates", values, (None, len(chosen)))
    lo, hi = model.domain.lo[chosen], model.domain.hi[chosen]
    if not len(values) or not ((lo <= values) & (values <= hi)).all():
        raise InputError("candidates, rest: expected at least one, all of them within K.")
    k = np.zeros((len(values), model.n_k))
    k[:, chosen] = values
    return k


class Leaving(NamedTuple):
    """When a manoeuvre may be left for the next. intervals: of the grid, after which it may at
    first. first, last: [s] after its beginning; at its end, where it rests, too. lasts: [s] in all.
    """

    intervals: int
    first: Fraction
    last: Fraction
    lasts: Fraction

    def may(self, passed: Any) -> Any:
        """Whether it may so many seconds after its beginning; also of a JAX array."""
        first, last = float(self.first - SAME), float(self.last + SAME)
        return (passed >= float(self.lasts - SAME)) | ((first <= passed) & (passed <= last))

    def require(self, passed: Fraction, name: str) -> None:
        """Raises InputError where it may not."""
        if not self.may(passed):
            raise InputError(
                f"{name}: expected a manoeuvre to be left from {float(self.first):.9g} s to "
                f"{float(self.last):.9g} s after its beginning, or at rest; this is after "
                f"{float(passed):.9g} s."
            )


def leaving(name: str, model: TrajectoryModel, leave: float) -> Leaving:
    """When manoeuvres of a model may be left, from `leave` [s] on, which is called
    `name`. Raises InputError, also for a time at which no run of the claim was left, and for runs
    that began later than their command.
    """
    if "begin" in (cut := model.claim.law.cut) and not cut["begin"].startswith("0 s "):
        raise InputError(
            "model: expected one whose runs begin with their command, as a manoeuvre does; "
            f"those of its claim begin {cut['begin']}. Learn it from bags with after=0."
        )
    dt, n = Fraction(model.time.dt), model.time.n_steps
    seconds = float(as_float64(name, leave, ()))
    intervals = math.ceil(seconds / model.time.dt - float(SAME))
    if not 0 < intervals <= n:
        raise InputError(
            f"{name}: expected a time to leave within a manoeuvre, above 0 s and up to "
            f"{model.time.t_f:g} s; got {leave!r}."
        )
    # a time that is a knot but for its rounding is that knot
    after, of_runs = min(intervals * dt, Fraction(seconds)), hand_over_of(model.claim.law.k_law)
    if of_runs is None:
        return Leaving(intervals, after, n * dt, n * dt)
    Leaving(intervals, *of_runs, n * dt).require(after, name)
    return Leaving(intervals, max(of_runs[0], after), of_runs[1], n * dt)


class Outlook(NamedTuple):
    """Predictions of candidates in the world frame; leading axis b.

    k (b, n_k). path (b, T + 1, n_p) [m] of the first reference point at all knots. q (b, n_q): the
    other goal states at the end. heading (b,) [rad] at the end, None where no goal state turns.
    leave: index of the first knot at which a manoeuvre may be left.
    """

    k: np.ndarray
    path: np.ndarray
    q: np.ndarray
    heading: np.ndarray | None
    leave: int


def outlook(model: TrajectoryModel, pose: Pose, k: np.ndarray, leave: int) -> Outlook:
    """Predict candidates k (b, n_k) from a pose by the model's network alone."""
    n_p, n_c, n_steps = model.n_p, model.n_c, model.time.n_steps
    of_first = n_c * np.arange(1, n_steps + 1)[:, None] - n_p + np.arange(n_p)
    rows = np.concatenate([of_first.ravel(), np.arange(model.layout.n_offsets, model.net.n_out)])
    # few rows at a time: for large products BLAS starts threads, which costs more than it saves
    parts = [outputs(model.net, k[some], rows) for some in slices(len(k), AT_ONCE)]
    y = np.concatenate(parts)
    path, q = y[:, : n_p * n_steps].reshape(-1, n_steps, n_p), y[:, n_p * n_steps :]
    path = np.concatenate([np.zeros((len(k), 1, n_p)), path], axis=1)
    if pose.heading is None:
        return Outlook(k, path + pose.place, q, None, leave)
    turns = np.array([word == TURNS for word in model.rotation], bool)
    q = q + pose.heading * turns
    heading = q[:, turns.argmax()] if turns.any() else None
    return Outlook(k, turned(path, -pose.heading) + pose.place, q, heading, leave)


def moved_last(
    model: TrajectoryModel, k: Float[np.ndarray, "b n_k"]
) -> tuple[Float[np.ndarray, " b"], Float[np.ndarray, " b"]]:
    """Motion [m] of the prediction in the last interval, and its excess over the motion that the
    tube allows for a robot at rest: the largest of all points and axes.

    A robot at rest is off by at most the tube of the interval at its beginning, and at its end by
    the lesser of that and the tube at the end. On an edge between bins any of them may allow it.
    """
    moved, beyond = [], []
    for some in slices(len(k), AT_ONCE):
        knots, _ = trajectories(model.net, model.layout, k[some])
        way = np.abs(knots[:, -1] - knots[:, -2])
        bins = model.tube.bins_of(k[some])
        during = model.tube.interval[bins, -1].max(axis=1)
        at_end = model.tube.final[bins, : model.n_c].max(axis=1)
        moved.append(way.max(axis=1))
        beyond.append((way - during - np.minimum(during, at_end)).max(axis=1))
    return np.concatenate(moved), np.concatenate(beyond)


def require_rest(
    model: TrajectoryModel, candidates: Float[np.ndarray, "b n_k"], given: tuple[int, ...]
) -> None:
    """Raises InputError for a model that moves in its last interval by more than its tube allows
    at rest, at any k that is tried: 2^SAMPLED even over K, its corners, and all candidates, their
    given parameters in the middle of K.
    """
    lo, hi = model.domain.lo, model.domain.hi
    even = lo + qmc.Sobol(model.n_k, seed=0).random_base2(SAMPLED) * (hi - lo)
    middle = candidates.copy()
    middle[:, list(given)] = ((lo + hi) / 2)[list(given)]
    corners = np.array(list(product(*zip(lo, hi, strict=True)))) if model.n_k <= CORNERS else even
    k = np.concatenate([even, corners, middle])
    moved, beyond = moved_last(model, k)
    i = int(np.argmax(beyond))
    if not beyond[i] <= ROUNDED:
        values = ", ".join(f"{x:.3g}" for x in k[i])
        raise InputError(
            f"model: expected one whose manoeuvres end at rest; at k = ({values}) it moves by "
            f"{moved[i]:.3g} m in its last {model.time.dt:g} s, {beyond[i]:.3g} m more than its "
            f"tube allows at rest. Learn it from runs that stop before {model.time.t_f:g} s."
        )


@dataclass(frozen=True, eq=False)
class Thinking:
    """Thinking time as a part of the manoeuvre: every run of the model begins when pose and speeds
    are measured, goes on as before for `seconds`, as it commands for `held`, then stops. [T39]

    seconds: [s] from measuring to the first moment of the new command, exactly; the command of a
    commitment begins at its `begin` plus this. before: given parameters of k that are the command
    under way, each with the chosen parameter that it continues with, by name or index.
    held: [s] for which a command is followed. rest: values of `before`, in its order, without a
    command: from the stop on, and at the first start.
    """

    seconds: float
    before: Mapping[str | int, str | int]
    held: float
    rest: Sequence[float]


class UnderWay:
    """The command under way, for a loop with thinking time. Raises InputError where `thinking` does
    not fit the model. axes: indices of the given parameters that are this command.
    """

    def __init__(self, thinking: Thinking, model: TrajectoryModel, given: tuple[int, ...]):
        before = thinking.before if isinstance(thinking.before, Mapping) else {}
        axes, chosen = (axes_of(words, model.labels.k) or () for words in (before, before.values()))
        rest = {*range(model.n_k)} - {*given}
        if {*chosen} != rest or not {*axes} <= {*given} or len(axes) != len(chosen):
            raise InputError(
                "thinking: expected every chosen parameter once, as what one given parameter goes "
                f"on with; got {thinking.before!r:.200}."
            )
        seconds, held = (
            Fraction(float(as_float64(f"thinking {name}", value, ())))
            for name, value in (("seconds", thinking.seconds), ("held", thinking.held))
        )
        if not (0 < seconds and 0 < held and seconds + held <= Fraction(model.time.t_f) + SAME):
            raise InputError(
                "thinking: expected seconds and held above 0 s, together within a manoeuvre of "
                f"{model.time.t_f:g} s; got {thinking.seconds!r} and {thinking.held!r}."
            )
        self.seconds, self._held = seconds, held
        self.axes, self._chosen = list(axes), list(chosen)
        self.rest = as_float64("thinking rest", thinking.rest, (len(axes),))
        lo, hi = model.domain.lo[self.axes], model.domain.hi[self.axes]
        if not ((lo <= self.rest) & (self.rest <= hi)).all():
            raise InputError(f"thinking: expected rest within K; got {self.rest.tolist()}.")

    @property
    def words(self) -> str:
        """When a command begins, how long it is followed, and what before and after."""
        first, last = (f"{float(x)!r} s" for x in (self.seconds, self.seconds + self._held))
        rest = ", ".join(map(repr, self.rest.tolist()))
        told = f"its command begins {first} after its begin and is followed until {last} after it"
        return f"{told}, from when on the command is ({rest})"

    def command(self, last: Commitment | None, at: Fraction) -> np.ndarray:
        """The command, values of `axes`, that lasts from a time for `seconds`. Raises InputError
        where it changes in between.
        """
        if last is None:
            return self.rest
        begun, ended = self.seconds, self.seconds + self._held
        first = at - last.begin
        then = first + self.seconds
        for values, begin, end in (
            (last.k[self.axes], Fraction(0), begun),
            (last.k[self._chosen], begun, ended),
            (self.rest, ended, None),
        ):
            if begin - SAME <= first and (end is None or then <= end + SAME):
                return values
        raise InputError(
            f"at: expected a time from which the command under way goes on for "
            f"{float(self.seconds):g} s; it is {float(first):g} s into a manoeuvre whose commands "
            f"change at {float(begun):g} and {float(ended):g} s."
        )
