"""What the start may do to a run: declared, tried to be refuted, and added to the tube.

A claim is about runs from the origin with heading 0, and the proof moves them to p0 and, where a
system declares `rotation`, turns them. If moving the start changes no offset and no final state by
more than `gap`, and turning it changes none by more than that, a run from anywhere stays in the
tube widened by what the two may do together, whenever the run from the origin stays in the tube:
every label stays true. How large the gap is cannot be shown by trying; a larger one seen in a trial
refutes the declaration. [T33]
"""

from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, generator
from parc_jax.common.spelling import rounded_up
from parc_jax.learning.bound.asked import check_gap
from parc_jax.learning.bound.claim import ErrorClaim, derived, weaker
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.system import System, rotation_of
from parc_jax.learning.systems.invariance import (
    can_be_headed,
    can_start_elsewhere,
    rotation_gap,
    translation_gap,
)

MOVED, TURNED = "TRANSLATION_INVARIANCE", "ROTATION_INVARIANCE"
STARTS = 8  # and as many headings: tried, up to FAR times the travelled distance away
FAR = 10.0


class StartTrial(NamedTuple):
    """declared: [m or rad] the most that the place of the start may matter, and once more its
    heading where the system declares `rotation`. seen, turned: largest effect of a place and of a
    heading in a trial, None = not tried.
    """

    declared: float
    seen: float | None
    turned: float | None = None

    def details(self) -> str:
        """One sentence."""
        tried = {"from other starts": self.seen, "with other headings": self.turned}
        found = [
            f"in {STARTS} runs {how} it mattered by at most {rounded_up(seen)}"
            for how, seen in tried.items()
            if seen is not None
        ]
        none = ["not measured, since these runs cannot be started elsewhere"]
        most = rounded_up(str(self.declared))
        return "; ".join([f"declared: the start matters by at most {most}", *(found or none)])


def invariances(rotation: tuple[str, ...] | None) -> tuple[str, ...]:
    """What a proof assumes that moves runs, and turns them where `rotation` is declared."""
    return (MOVED,) if rotation is None else (MOVED, TURNED)


def try_starts(system: System, key: jax.Array, declared: float) -> StartTrial:
    """Run the system from other starts, and with other headings, as far as it can be, and compare.
    Uses the SEARCH stream of `key`, not consumed.

    declared: [m or rad], what `allow_for_start` will add to the tube. Raises InputError when the
        start, or its heading, matters more.
    """
    check_gap(declared)
    turned = try_headings(system, key, declared)
    if not can_start_elsewhere(system):
        return StartTrial(declared, None, turned)
    few = collect(system, key, STARTS, Stage.SEARCH, quiet=True)
    travelled = np.abs(np.where(np.isfinite(few.p), few.p, 0.0)).max(initial=1.0)
    rng = generator(key)
    starts = FAR * float(travelled) * rng.uniform(-1, 1, (STARTS, system.n_p))
    found = translation_gap(system, key, starts)
    seen = float(max(found.p.max(), found.q.max(initial=0.0)))
    if seen > declared:
        raise InputError(
            f"{system.name}: expected runs that do not depend on where they start by more than "
            f"{declared:.3g}; moving the start by up to {np.abs(starts).max():.3g} m moved the "
            f"offsets by {found.p.max():.3g} m and the final states by "
            f"{found.q.max(initial=0.0):.3g}. Make the start part of k, or declare a --gap that "
            "holds everywhere: the tube is widened by it."
        )
    return StartTrial(declared, seen, turned)


def try_headings(system: System, key: jax.Array, declared: float) -> float | None:
    """Run a system that declares `rotation` with other headings, if it can be: the largest effect;
    None where nothing is declared or tried. Raises InputError when above declared [m or rad].
    """
    if rotation_of(system) is None or not can_be_headed(system):
        return None
    rng = generator(key)
    found = rotation_gap(system, key, rng.uniform(-np.pi, np.pi, STARTS))
    seen = float(max(found.p.max(), found.q.max(initial=0.0)))
    if not seen <= declared:
        raise InputError(
            f"{system.name}: expected runs that turn with their heading to within {declared:.3g}, "
            f"as it declares; they differ by up to {seen:.3g}. Leave `rotation` out, or make the "
            "heading part of k."
        )
    return seen


def allow_for_start(claim: ErrorClaim, trial: StartTrial) -> ErrorClaim:
    """The claim about runs from any start: the tube wider by the declared gap, and by the same once
    more where `rotation` is declared, for a run from elsewhere with another heading is off by both;
    the ledger names each. [T33]

    Last of all steps that change a tube: `update` knows nothing of it.
    """
    entries = invariances(claim.subject.rotation)
    off = len(entries) * trial.declared
    gaps = claim.tube.halves_around(off, off)
    both = zip(claim.tube.halves, gaps, strict=True)
    wider = claim.tube.with_halves(*(np.nextafter(half + more, np.inf) for half, more in both))
    tries = zip(entries, (trial.seen, trial.turned), ("starts", "headings"), strict=False)
    named = {entry: _named(entry, trial.declared, seen, of) for entry, seen, of in tries}
    ledger = tuple(named.get(entry, entry) for entry in claim.assumptions)
    start = {
        "gap": trial.declared.hex(),
        "seen": trial.seen and trial.seen.hex(),
        "turned": trial.turned and trial.turned.hex(),
    }
    return derived(weaker(claim, wider, start=start), assumptions=ledger)


def _named(entry: str, declared: float, seen: float | None, of: str) -> str:
    tried = "not measured" if seen is None else f"{rounded_up(seen)} seen from {STARTS} {of}"
    return f"{entry}(within {rounded_up(str(declared), 6)}; {tried})"
