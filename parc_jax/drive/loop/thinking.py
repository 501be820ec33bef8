"""Thinking takes time: the command that is under way goes on for as long, as a part of every run.
[T39]
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.drive.loop.commitment import Commitment
from parc_jax.learning.labels import name_of
from parc_jax.learning.model import TrajectoryModel

SAME = Fraction(1, 10**6)  # [s] moments of a clock that are one: what is told in floats


@dataclass(frozen=True, eq=False)
class Thinking:
    """Thinking time as a part of the manoeuvre. Every run of the model begins when pose and speeds
    are measured, goes on for `seconds` with the command that is under way then, and follows the new
    one from there on, for `held`; then it stops.

    seconds: [s] from measuring to the first moment of the new command: no more, no less. Whoever
    drives begins the command of a commitment at its `begin` plus this. before: given parameters of
    k that are the command under way, each with the chosen parameter that it goes on with, by name
    or number. held: [s] for which a command is followed. rest: values of `before`, in its order,
    while none is: from the stop on, and at the first start.
    """

    seconds: float
    before: Mapping[str | int, str | int]
    held: float
    rest: Sequence[float]


class UnderWay:
    """What is under way at a time, for a loop that thinks. Raises InputError for what does not fit
    the model. axes: of the given parameters that it knows.
    """

    def __init__(self, thinking: Thinking, model: TrajectoryModel, given: tuple[int, ...]):
        names = [name_of(label) for label in model.labels.k]
        pairs = [
            [names.index(name) if name in names else name for name in pair]
            for pair in thinking.before.items()
        ]
        fits = all(a in given and b not in given and b in range(model.n_k) for a, b in pairs)
        chosen = {b for _, b in pairs}
        if not fits or len(chosen) < len(pairs) or len(chosen) < model.n_k - len(given):
            raise InputError(
                "thinking: expected every chosen parameter once, as what a given one goes on "
                f"with; got {dict(thinking.before)!r:.200}."
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
        self.axes, self._chosen = [a for a, _ in pairs], [b for _, b in pairs]
        self.rest = as_float64("thinking rest", thinking.rest, (len(pairs),))
        lo, hi = model.domain.lo[self.axes], model.domain.hi[self.axes]
        if not ((lo <= self.rest) & (self.rest <= hi)).all():
            raise InputError(f"thinking: expected rest within K; got {self.rest.tolist()}.")

    def command(self, last: Commitment | None, at: Fraction) -> np.ndarray:
        """The command, values of `axes`, that goes on from a time for as long as is thought. Raises
        InputError where it changes in between.
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
