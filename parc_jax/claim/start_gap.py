"""What the start may do to a run: declared, tried to be refuted, and added to the tube.

A claim is about runs from the origin, and the proof moves them to p0. If moving the start changes
no offset and no final state by more than `gap`, a run from anywhere stays in the tube widened by
it, whenever the run from the origin
stays in the tube: every label stays true. How large the gap is cannot be shown by trying starts; a
larger one seen in a trial refutes the declaration. [T33]
"""

from dataclasses import replace
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.claim.claim import ErrorClaim, weaker
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.rollout.collect import collect
from parc_jax.rollout.headings import can_be_headed, rotation_gap
from parc_jax.rollout.invariance import can_start_elsewhere, translation_gap
from parc_jax.system import rotation_of

IDENTIFIER = "TRANSLATION_INVARIANCE"
STARTS = 8  # tried, up to FAR times the travelled distance away
FAR = 10.0


class StartTrial(NamedTuple):
    """declared: [m or rad] the most that the start may matter. seen: largest effect in a trial,
    None = not tried.
    """

    declared: float
    seen: float | None

    def statement(self) -> str:
        """One sentence."""
        if self.seen is None:
            return (
                f"declared: the start matters by at most {self.declared:.2g}; not measured, since "
                "these runs cannot be "
                "started elsewhere"
            )
        return (
            f"declared: the start matters by at most {self.declared:.2g}; in {STARTS} runs from "
            "other starts it "
            f"mattered by at most {self.seen:.2g}"
        )


def try_starts(system, key: jax.Array, declared: float) -> StartTrial:
    """Run the system from other starts, if it can, and compare. Uses the SEARCH stream of `key`,
    not consumed.

    declared: [m or rad], what `allow_for_start` will add to the tube. Raises InputError when the
        start matters more.
    """
    if not declared >= 0:
        raise InputError(
            "gap: expected how much the start may matter, a number >= 0 [m or rad]; got "
            f"{declared}."
        )
    if not can_start_elsewhere(system):
        return StartTrial(declared, None)
    few = collect(system, key, STARTS, Stage.SEARCH, quiet=True)
    travelled = np.abs(np.where(np.isfinite(few.p), few.p, 0.0)).max(initial=1.0)
    rng = np.random.default_rng(np.asarray(jax.random.key_data(key), np.uint32))
    starts = FAR * float(travelled) * rng.uniform(-1, 1, (STARTS, system.n_p))
    found = translation_gap(system, key, starts)
    seen = float(max(found.p.max(), found.q.max(initial=0.0)))
    if seen > declared:
        raise InputError(
            f"{system.name}: expected runs that do not depend on where they start by more than "
            f"{declared:.3g}; moving "
            f"the start by up to {np.abs(starts).max():.3g} m moved the offsets by "
            f"{found.p.max():.3g} m and the final "
            f"states by {found.q.max(initial=0.0):.3g}. Make the start part of k, or declare a "
            "--gap that holds "
            "everywhere: the tube is widened by it."
        )
    return StartTrial(declared, seen)


def try_headings(system, key: jax.Array, declared: float) -> float | None:
    """Run a system that declares `rotation` with other headings, if it can be, and compare: the
    largest effect seen, None where nothing is declared or tried. Raises InputError when it is
    larger than declared [m or rad].
    """
    if rotation_of(system) is None or not can_be_headed(system):
        return None
    rng = np.random.default_rng(np.asarray(jax.random.key_data(key), np.uint32))
    found = rotation_gap(system, key, rng.uniform(-np.pi, np.pi, STARTS))
    seen = max(found.p, float(found.q.max(initial=0.0)))
    if not seen <= declared:
        raise InputError(
            f"{system.name}: expected runs that turn with their heading to within {declared:.3g}, "
            f"as it declares; they differ by up to {seen:.3g}. Leave `rotation` out, or make the "
            "heading part of k."
        )
    return seen


def allow_for_start(claim: ErrorClaim, trial: StartTrial) -> ErrorClaim:
    """The claim about runs from any start: the tube wider by the declared gap, which the ledger
    names.

    Last of all steps that change a tube: `enlarge` and `update` know nothing of it.
    """
    gaps = claim.tube.halves_around(trial.declared, trial.declared)
    both = zip(claim.tube.halves, gaps, strict=True)
    wider = claim.tube.with_halves(*(np.nextafter(half + more, np.inf) for half, more in both))
    tried = "not measured" if trial.seen is None else f"{trial.seen:.2g} seen from {STARTS} starts"
    named = f"{IDENTIFIER}(within {trial.declared:g}; {tried})"
    ledger = tuple(named if entry == IDENTIFIER else entry for entry in claim.assumptions)
    return replace(
        weaker(
            claim,
            wider,
            start={"gap": trial.declared.hex(), "seen": trial.seen and trial.seen.hex()},
        ),
        assumptions=ledger,
    )
