"""Influence of the start on a run: declared, tried to be refuted, and added to the tube.

A claim is about runs from the origin with heading 0, and the proof moves them to p0 and, where a
system declares `rotation`, turns them. If moving the start changes no offset and no final state by
more than `gap`, and turning it changes none by more than that, a run from anywhere stays in the
tube widened by what the two may do together, whenever the run from the origin stays in the tube:
every label stays true. How large the gap is cannot be shown by trying; a larger one seen in a trial
refutes the declaration. [T22, T33]
"""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import numpy.typing as npt
from jax.interpreters.partial_eval import dce_jaxpr

from parc_jax.checker.claim import STARTS
from parc_jax.common.arrays import difference
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, generator
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import rounded_up
from parc_jax.learning.bound.claim import ErrorClaim, derived, weaker
from parc_jax.learning.bound.settings import GAP, check_gap
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.chunks import require_same_runs
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.law import law_of
from parc_jax.learning.runs.simulate import is_traceable, simulator, traced
from parc_jax.learning.system import TURNS, System, Trajectory, rotation_of
from parc_jax.learning.systems.chained import Chained
from parc_jax.learning.systems.user_code import blamed

MOVED, TURNED = "TRANSLATION_INVARIANCE", "ROTATION_INVARIANCE"
ALIKE = "NO_DISTURBANCE"
FEW = ("none", "one", "two", "three", "four", "five", "six", "seven")  # checkers read numbers
SAME = 1e-4  # [of the distance travelled] by which runs that are compiled apart may round apart
FAR = 10.0  # times the travelled distance: as far away are STARTS starts, beside as many headings


class StartGap(NamedTuple):
    """Largest differences of runs, over runs and times, when their start moves or turns.

    p: (n_p,) [m]. q: (n_q,). starts: (n, n_p) [m] tried, or headings (n,) [rad]. k: (n, n_k).
    NaN against NaN is no difference, NaN against a number an infinite one.
    """

    p: np.ndarray
    q: np.ndarray
    starts: np.ndarray
    k: np.ndarray

    @property
    def largest(self) -> float:
        """Of any coordinate."""
        return float(max(self.p.max(), self.q.max(initial=0.0)))


def translation_gap(system: Any, key: jax.Array, starts: npt.ArrayLike, k: Any = None) -> StartGap:
    """Run the same k and disturbance from the origin and from each of `starts` (n, n_p) [m], and
    compare offsets. Uses the SEARCH stream of `key`. k (n, n_k): by default drawn from K.

    The system must offer `rollout_from(key, k, p0) -> Trajectory`, with p relative to p0, or, if it
    is not JAX, `rollout_from_batch(keys, ks, p0s)`. Rounding alone leaves a gap of about 1e-12 m in
    a smooth system; a chaotic one may turn that into more. Raises InputError without the method.
    """
    many = getattr(system, "rollout_from_batch", None)
    if not callable(many):
        if not callable(getattr(system, "rollout_from", None)):
            raise InputError(
                f"translation_gap: expected {system.name} to offer rollout_from(key, k, p0) -> "
                "Trajectory; it does not. Without it, invariance is an assumption of every claim."
            )
        many = jax.jit(jax.vmap(system.rollout_from))
    starts = np.asarray(starts, np.float64)
    if starts.ndim != 2 or starts.shape[1] != system.n_p:
        raise InputError(f"translation_gap: expected starts (n, {system.n_p}); got {starts.shape}.")
    k, here, there = _both(system, key, many, starts, "rollout_from(key, k, p0)", k)
    p = difference(here.p, there.p).reshape(-1, system.n_p).max(axis=0)
    return StartGap(p, difference(here.q, there.q).max(axis=0), starts, k)


def rotation_gap(system: Any, key: jax.Array, headings: npt.ArrayLike, k: Any = None) -> StartGap:
    """Run the same k and disturbance with heading 0 and with each of `headings` (n,) [rad] at the
    start, turned back, and compare. key, k: as of `translation_gap`. Raises InputError.

    The system declares `rotation` and offers `rollout_headed(key, k, heading) -> Trajectory`, p
    relative to the start and not turned back.
    """
    rotation, headings = rotation_of(system) or (), np.asarray(headings, np.float64)
    many = jax.jit(jax.vmap(system.rollout_headed))
    k, straight, headed = _both(system, key, many, headings, "rollout_headed(key, k, heading)", k)
    cosine, sine = np.cos(headings), np.sin(headings)
    back = np.array([[cosine, sine], [-sine, cosine]])
    places = np.asarray(headed.p).reshape(len(headings), -1, 2)
    turned = np.einsum("abn,nsb->nsa", back, places)
    word = np.array([word == TURNS for word in rotation], float)
    angles = np.asarray(headed.q) - headings[:, None] * word
    p = difference(turned, np.asarray(straight.p).reshape(turned.shape)).max(axis=(0, 1))
    return StartGap(p, difference(angles, straight.q).max(axis=0), headings, k)


def _both(
    system: Any, key: jax.Array, many: Callable, starts: np.ndarray, call: str, k: Any
) -> tuple[np.ndarray, Trajectory, Trajectory]:
    """k (n, n_k), and their runs from zero and from starts (n, ...), by one call of many (keys, k,
    starts). Raises InputError for a fault in the user's `call`.
    """
    own = collect(system, key, len(starts), Stage.SEARCH, k=k, quiet=True)
    runs, zeros = simulator(system), np.zeros_like(starts)
    rows = runs.rows(key, Stage.SEARCH, np.arange(len(starts)), k)

    def made(starts: np.ndarray, double: bool = True) -> Trajectory:
        with jax.enable_x64(double), blamed(f"{system.name}: expected {call} to run"):
            now = many(rows.keys, jnp.asarray(rows.k), jnp.asarray(starts))
            # a copy: a batch simulator may return the same memory again
            return now._replace(p=np.array(now.p), q=np.array(now.q))

    here, there = made(zeros), made(starts)
    # compared as the system is run; in float64, for the gap, a system in float32 draws otherwise
    same = here if runs.double else made(zeros, False)
    both = [np.asarray(x, np.float64).reshape(len(starts), -1) for x in (own.p, same.p)]
    some = np.isfinite(both).all(axis=(0, 2))
    off = max(difference(*both).max(), difference(own.q, same.q).max(initial=0.0))
    alike = off <= SAME * np.abs(both[0][some]).max(initial=1.0)
    if not (some.any() and np.isfinite(there.p).any() and alike):
        what = f"differ by {off:.3g}" if some.any() and not alike else "are not finite"
        raise InputError(
            f"{system.name}: expected {call} to make from zero the runs that the system makes of "
            f"the same keys and k, and some from elsewhere; those of {len(starts)} {what}."
        )
    return rows.k, here, there


class StartTrial(NamedTuple):
    """Declared influence of the start, and the largest one of trials; and whether keys matter.

    declared: [m or rad] bound on the influence of the place of the start, and once more of its
        heading where the system declares `rotation`. seen, turned: largest effect of a place and of
        a heading in a trial, None = not tried. alike: number of k of which two keys were compared
        and changed no run. ended: runs from as many starts, and headings, were compared.
    """

    declared: float
    seen: float | None
    turned: float | None = None
    alike: int = 0
    ended: int = STARTS

    @property
    def record(self) -> dict[str, str | None]:
        """As evidence of a claim: numbers as hex floats."""
        names = ("gap", "seen", "turned")
        return {n: None if x is None else x.hex() for n, x in zip(names, self[:3], strict=True)}

    def said_in(self, assumptions: Iterable[str]) -> tuple[str, ...]:
        """The assumptions, those on the start with its numbers."""
        named, tried = {}, ((MOVED, self.seen, "starts"), (TURNED, self.turned, "headings"))
        for entry, x, of in tried:
            of += f", {FEW[self.ended]} of them compared" if self.ended < STARTS else ""
            seen = "not measured" if x is None else f"{rounded_up(x, 6)} seen from {STARTS} {of}"
            named[entry] = f"{entry}(within {rounded_up(str(self.declared), 6)}; {seen})"
        alike = "k, runs of each under two keys are the same to the last bit)"
        told = [f"{ALIKE}(of {self.alike} {alike}"] if self.alike else []
        return (*(named.get(entry, entry) for entry in assumptions), *told)


def invariances(rotation: tuple[str, ...] | None) -> tuple[str, ...]:
    """Assumptions of a proof that moves runs, and turns them where `rotation` is declared."""
    return (MOVED,) if rotation is None else (MOVED, TURNED)


def try_starts(system: System, key: jax.Array, declared: float, K: Box | None = None) -> StartTrial:
    """Compare runs from other starts, and with other headings, as far as the system offers them.
    Uses the SEARCH stream of `key`, not consumed.

    declared: [m or rad], by which `allow_for_start` will widen the tube. Raises InputError when the
        start, or its heading, matters more. K: of which k are tried, by default that of the system.
    """
    check_gap(declared)
    turned = None
    if isinstance(system, Chained):  # its runs begin in motion, and those to try at rest
        return StartTrial(declared, None)
    K = K or system.domain
    k = generator(key).uniform(K.lo, K.hi, (STARTS, K.n))
    # code of the user, which may seed what it likes; most tell by the first k
    by_key, by_python = _decided(system)
    same: list[bool] = []
    for some in (k[:1], k[1:]) if by_python else ():
        same += _alike(system, key, some) if all(same) else []
    alike = len(same) * all(same) if by_python else STARTS * (not by_key)
    if by_python and not alike and is_traceable(system):  # callbacks may draw once for all runs
        both = (collect(system, key, STARTS, Stage.SEARCH, k=k, quiet=True) for _ in range(2))
        first, again = ({"p": x.p, "q": x.q} for x in both)
        require_same_runs(system.name, first, again, system)
    headed = rotation_of(system) is not None and callable(getattr(system, "rollout_headed", None))
    offered = ("rollout_from", "rollout_from_batch")
    moved = any(callable(getattr(system, name, None)) for name in offered)
    if not (headed or moved):
        return StartTrial(declared, None, None, alike)
    few = collect(system, key, STARTS, Stage.SEARCH, k=k, quiet=True)
    ended = STARTS - int(few.failed.sum())  # where others end elsewhere, they differ
    if headed:
        turned = rotation_gap(system, key, generator(key).uniform(-np.pi, np.pi, STARTS), k).largest
        if not turned <= declared:
            raise InputError(
                f"{system.name}: expected runs that turn with their heading to within "
                f"{declared:.3g}, as it declares; they differ by up to {turned:.3g}. Leave "
                "`rotation` out, or make the heading part of k."
            )
    if not moved:
        return StartTrial(declared, None, turned, alike, ended)
    travelled = np.abs(np.where(np.isfinite(few.p), few.p, 0.0)).max(initial=1.0)
    starts = FAR * float(travelled) * generator(key).uniform(-1, 1, (STARTS, system.n_p))
    gap = translation_gap(system, key, starts, k)
    if gap.largest > declared:
        raise InputError(
            f"{system.name}: expected runs that do not depend on where they start by more than "
            f"{declared:.3g}; moving the start by up to {np.abs(starts).max():.3g} m moved the "
            f"offsets by {gap.p.max():.3g} m and the final states by "
            f"{gap.q.max(initial=0.0):.3g}. Make the start part of k, or declare a --gap that "
            "holds everywhere: the tube is widened by it."
        )
    return StartTrial(declared, gap.largest, turned, alike, ended)


def _alike(system: System, key: jax.Array, k: np.ndarray) -> list[bool]:
    """Of each of k (n, n_k) of which a run of two keys ends: are both the same to the last bit?"""
    n = len(k)  # in two calls: what Python draws may be one number for all runs of a call
    one, two = (collect(system, key, n, Stage.SEARCH, k=k, first_row=x, quiet=True) for x in (0, n))
    same = (one.p == two.p).all(axis=(1, 2)) & (one.q == two.q).all(axis=1)
    return same[~(one.failed & two.failed)].tolist()


def _decided(system: Any) -> tuple[bool, bool]:
    """Are outputs of a system's program made from its key, and does Python have a say?"""
    if not is_traceable(system):
        return True, True
    made = traced(system, simulator(system).double)
    used, (reads, _) = dce_jaxpr(made.jaxpr, [True] * len(made.out_avals))
    return reads, any(f"{x}_callback[" in str(used) for x in ("pure", "io"))  # `debug_` prints


def declared_gap(claim: ErrorClaim, unsaid: float = 0.0) -> float:
    """[m or rad] the most that the place of the start may matter, as a claim declares; `unsaid`
    where it says that it does not matter. Raises InputError for a claim of an earlier form.
    """
    if (start := claim.evidence.get("start")) is None:
        return unsaid
    if not isinstance(start["gap"], str):
        raise InputError("claim: expected its start's gap as text; got a number. Bound anew.")
    return float.fromhex(start["gap"])


def trial_of(claim: ErrorClaim, system: System | RolloutBatch, key: jax.Array) -> StartTrial | None:
    """The trial behind further runs; None where the claim tells of its own, on a plant so named."""
    if isinstance(system, RolloutBatch):  # recorded runs cannot be started elsewhere
        return StartTrial(declared_gap(claim), None)
    told = claim.evidence.get("start", {}).get("seen") is not None
    new = not told or claim.law.source != law_of(system).source
    return try_starts(system, key, declared_gap(claim, GAP), claim.domain) if new else None


def off_from_start(claim: ErrorClaim, start: StartTrial | None = None) -> float:
    """[m or rad] by which a run from anywhere may differ from the one at the origin, once more for
    its heading where `rotation` is declared. start: of further runs; None as the claim declares.
    """
    gap = declared_gap(claim) if start is None else start.declared
    return len(invariances(claim.subject.rotation)) * gap


def allow_for_start(claim: ErrorClaim, trial: StartTrial) -> ErrorClaim:
    """The claim about runs from any start: the tube wider by the declared gap, and by the same once
    more where `rotation` is declared, for a run from elsewhere with another heading is off by both;
    the ledger names each. [T33]

    Last of all steps that change a tube: `update` starts from the gap in its evidence.
    """
    off = off_from_start(claim, trial)
    both = zip(claim.tube.halves, claim.tube.halves_around(off, off), strict=True)
    wider = claim.tube.with_halves(*(np.nextafter(half + more, np.inf) for half, more in both))
    told = trial.said_in(claim.assumptions)
    return derived(weaker(claim, wider, start=trial.record), assumptions=told)
