"""Looks at fresh runs: how many are declared, how many are taken, what each of them may err.

A look is a test that may decide which plan is driven, or which set of them is drawn from. m of
them, declared beforehand, get delta / m each, whatever they are about and however it is spelled, so
that all of them together err with probability at most delta. [T1, T6, T42]
"""

from collections import Counter
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.arrays import content_hash
from parc_jax.common.errors import InputError, check_count
from parc_jax.common.keys import Stage, folded, stream
from parc_jax.common.spelling import counted, rounded_down, rounded_up
from parc_jax.learning.bound.counts import as_probability

DELTA = Fraction(1, 1000)  # of all looks together, by default


class Look(NamedTuple):
    """One of the declared looks. number: from 1. delta: its share. others: those before it here."""

    number: int
    planned: int
    delta: Fraction
    others: tuple[Fraction, ...] = ()

    @property
    def sure(self) -> str:
        """The confidence of its test, for sentences."""
        return rounded_down(1 - self.delta, 10)

    def numbered(self, begin: str, end: str = "") -> str:
        """Its number in a sentence; empty where it was declared alone."""
        return f"{begin} {self.number} of {self.planned}{end}" if self.planned > 1 else ""

    @property
    def ledger(self) -> tuple[str, ...]:
        """The assumptions on other tests, of plans or of sets."""
        unseen = "UNSEEN(1 look; before it only looks told here chose sets or plans of this scene)"
        told = [f"{self.number} of {self.planned}, which share one delta"] * (self.planned > 1)
        others = [(n, rounded_up(x, 10)) for x, n in Counter(self.others).items()]
        told += [f"after {counted(n, 'look')} of another delta, {x}" for n, x in others]
        return (unseen, f"LOOK({'; '.join(told)})") if told else (unseen,)


@dataclass(eq=False, repr=False)
class Looks:
    """The account of the looks at one answer and at all that is derived from it, or of tests of
    sets in any scenes: choices, local claims, `Validate` and copies hold this very object. It is
    mutable by design: a look is spent when its runs are made, with every outcome.

    delta: error probability of all looks together, None until `declare`. planned: how many may be
    taken. taken: how many were. others: deltas of other accounts that tested sets of this answer.
    """

    delta: Fraction | None = None
    planned: int = 0
    taken: int = 0
    others: tuple[Fraction, ...] = ()

    def __repr__(self) -> str:
        own = "none declared"
        if self.delta is not None:
            own = f"{self.taken} of {self.planned} taken, delta {rounded_up(self.delta)}"
        others = f"; {counted(len(self.others), 'look')} of other accounts" if self.others else ""
        return f"Looks({own}{others})"

    def __copy__(self, *_) -> "Looks":
        return self

    __deepcopy__ = __copy__

    def declare(
        self, delta: Fraction | float | str | None = None, planned: int | None = None
    ) -> "Looks":
        """The account itself, with so many looks. Declared once, before the first is taken; the
        same again changes nothing. None: as it was declared, at first 1e-3 and one look. Raises
        InputError for anything else.
        """
        if delta is None:
            delta = DELTA if self.delta is None else self.delta
        if planned is None:
            planned = max(1, self.planned)
        check_count("looks", planned, 1, "the number of tests that may decide what is driven")
        delta = as_probability("delta", delta)
        if self.delta is None:
            self.delta, self.planned = delta, planned
        if (delta, planned) != (self.delta, self.planned):
            raise InputError(
                f"looks: expected those declared by the first choice, {self!r}; got {planned} "
                f"looks and delta = {delta}."
            )
        return self

    def to_json(self) -> dict | None:
        """As plain data, for the answer file; None where none are declared, nor others known."""
        if self.delta is None and not self.others:
            return None
        delta, others = self.delta and str(self.delta), [str(x) for x in self.others]
        return {"delta": delta, "planned": self.planned, "taken": self.taken, "others": others}

    def take(self, here: "Looks | None" = None) -> Look:
        """The next look. here: the account of the answer, if that is another one; each then tells
        of the other. Raises InputError when all that were declared are spent.
        """
        if self.delta is None:
            raise InputError("looks: expected some to be declared before one is taken; none are.")
        if self.taken >= self.planned:
            raise InputError(
                f"looks: all {self.planned} that were declared are spent, and one more would be "
                "wrong more often than it says. Declare more beforehand: looks="
                f"{self.planned + 1} splits delta over them."
            )
        self.taken += 1
        share, others = self.delta / self.planned, (here or self).others
        if here is not None and here is not self:
            others += (here.delta,) if here.delta and here.taken else ()
            here.others += (share,)
        return Look(self.taken, self.planned, share, others)


def looks_of_json(data: dict | None) -> Looks:
    """The account of `Looks.to_json`, which goes on where it was. Raises InputError."""
    looks = Looks()
    if data is not None:
        if data["delta"] is not None:
            looks.declare(Fraction(data["delta"]), data["planned"])
        looks.taken, looks.others = data["taken"], tuple(map(Fraction, data.get("others", ())))
        check_count("looks taken", looks.taken, 0, "how many were taken")
        if looks.taken > looks.planned or not all(0 < delta < 1 for delta in looks.others):
            raise InputError("looks: expected no more taken than planned, and deltas below 1.")
    return looks


def fresh_key(key: jax.Array, look: Look, *about: np.ndarray) -> jax.Array:
    """A key for the runs of one look at `about` (plan, box): its streams meet neither those of
    `key` nor those of another look, nor those of a look at anything else.

    A choice that depends on earlier runs needs runs independent of them, disturbances included.
    """
    arrays = [np.atleast_1d(np.asarray(x, np.float64)) for x in about]
    words = np.frombuffer(bytes.fromhex(content_hash(*arrays)[:32]), ">u4")
    fresh = stream(key, Stage.DRIVEN)
    for word in (look.number, *words):
        fresh = folded(fresh, int(word))
    return fresh
