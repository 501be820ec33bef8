"""After deployment: an alarm by bets against a claim. [T32]"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from parc_jax.common.arrays import Sealed, at_least, in_chunks
from parc_jax.common.errors import InputError, check_kind
from parc_jax.common.premises import ASSUMED, MEASURED, Premises, agree, premises, text_of
from parc_jax.common.spelling import counted, rounded_down, rounded_up
from parc_jax.learning.bound.calibrate import lost_among
from parc_jax.learning.bound.claim import ErrorClaim, check_network
from parc_jax.learning.bound.counts import RECORDINGS, RUNS, NoStatement, as_probability
from parc_jax.learning.bound.fresh import left_out_beside, not_named, used_by
from parc_jax.learning.bound.measure import allowance, chunk_size, kept, moves_of
from parc_jax.learning.bound.settings import check_between, intersample_of
from parc_jax.learning.bound.statement import DIGITS
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch, require_failed
from parc_jax.learning.runs.groups import NAMED, worst_by_group
from parc_jax.learning.runs.independent import marks_by_k, repeated
from parc_jax.learning.runs.joined import joined_source
from parc_jax.learning.runs.law import LOG, PLACES, STATED

SAME = "each run, whatever came before, is one of the claim's law"
_BETS = 16  # alternatives, log-spaced from just above the claimed rate to one half


@dataclass(frozen=True, eq=False, repr=False)
class Monitor(Sealed):
    """An e-process against "runs leave the tube with probability <= rate". Make it with `monitor`.

    log_wealth: (bets,) logarithm of the wealth of each bet. seen, left: runs observed, runs outside
    the tube. peak: largest e-value so far. alpha: bound on the probability of an alarm, ever, under
    a true claim. declared: the law of k that the caller declared, in words. ids, marks, groups,
    spans: of the observed runs by content and by k, their recordings, and their files with the
    first and the last row of each.
    missing: rows of these files, by file, that were not observed, among which those that failed may
    be. failed: of them, those that `closed` counted. lost: of the runs, those made again. laws: of
    the observed runs, in words. logs: whether any are of a log. of: hash of the claim. cut: bets on
    runs that stayed, but were followed in part alone; followed: the sum of these parts. unknown:
    bets on runs of which nobody knows whether they left.
    """

    claim: ErrorClaim
    net: ReLUNetwork
    rate: float
    alpha: float
    bets: np.ndarray
    log_wealth: np.ndarray
    seen: int = 0
    left: int = 0
    peak: float = 1.0
    declared: str = ""
    ids: frozenset[bytes] = frozenset()
    marks: frozenset[str] = frozenset()
    groups: frozenset[int] = frozenset()
    spans: Mapping[tuple[str, str], tuple[int, int]] = field(default_factory=dict)
    missing: Mapping[tuple[str, str], int] = field(default_factory=dict)
    failed: int = 0
    lost: tuple[int | str, ...] = ()
    unnamed: bool = False
    laws: frozenset[str] = frozenset()
    logs: bool = False
    of: str = ""
    cut: int = 0
    followed: float = 0.0
    unknown: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_network(self.claim, self.net)
        if self.of != self.claim.hash:
            raise InputError(
                f"monitor: expected the claim against which its bets were made ({self.of[:12]}); "
                f"got another one ({self.claim.hash[:12]}). Watch it anew: monitor(claim, net)."
            )

    @property
    def e_value(self) -> float:
        """Mean wealth of the bets; under a true claim its expectation never exceeds one. [T32]"""
        top = self.log_wealth.max()
        return float(np.exp(min(700.0, top)) * np.exp(self.log_wealth - top).mean())

    def __repr__(self) -> str:
        rings = "ALARM" if self.alarm else "no alarm"
        return f"<Monitor: {rings}, of {self.premises['seen']} {self.left:,} left the tube>"

    @property
    def alarm(self) -> bool:
        """True when the claim is refuted at level alpha, for good: the largest wealth counts."""
        return bool(self.peak >= 1.0 / self.alpha)

    @property
    def premises(self) -> Premises:
        """Premises of its sentence."""
        claim, law = self.claim, self.declared or f"k {self.claim.law.how_drawn}, as the claim's"
        law += "".join(f", places {told}" for x, told in claim.law.parameters if x == PLACES)
        if not claim.tube.claimed.all():
            law += ", of those in bins that have a claim"
        short = rounded_down if self.alarm else rounded_up
        bets = self.seen - self.failed - len(self.groups or self.ids)
        longer = bets > 0 and claim.unit != RUNS  # one of a drive is a part of a recording
        many = claim.unit.many + " and manoeuvres" * longer
        unknown = f" ({self.unknown:,} of which nobody knows whether they left, no win of a bet)"
        told: dict[str, Any] = {
            "claim": claim.hash[:12],
            "rate": rounded_up(str(self.rate), DIGITS),
            "alpha": rounded_up(str(self.alpha), DIGITS),
            "seen": counted(self.seen, many.replace("s and", " or").removesuffix("s"), many)
            + unknown * bool(self.unknown),
            "laws": sorted(self.laws) or "whose law nobody told",
            "left": self.left,
            # one that rings has no less than rings, also where both are told in short
            "largest": f"{rounded_down(self.peak, 3)} of {short(1 / self.alpha, 3)}",
            "alarm": int(self.alarm),
            "counted as failed": self.failed,
        }
        part = "each that stayed followed to its end"
        if self.cut:
            share = rounded_down(100 * self.followed / self.cut, 3)
            part = f"{self.cut:,} that stayed followed for {share} % of their time alone"
        part += ", a shield's seen at its steps alone, its rest after the end included"
        part += ", not by q" * (claim.tube.n_q > 0)
        gone = [f"{n:,} of {name}" for (name, _), n in self.missing.items() if n]
        assumed = {
            "LAW": law,
            "TOLD": [f"{bets:,} by `bet`, not looked at, {part}"] * (bets > 0),
            "INDEPENDENT": ["each that is told by `bet` is a new recording of its own"] * longer,
            "FRESH": not_named(claim, self.logs),
            "MISSING": gone,
            "ORDER_OF_K": ["not all have names"][: self.unnamed],
        }
        assumed |= {"WORKERS_LOST": [f"{n}, independent of the run" for n in self.lost]}
        entries = [(name, ASSUMED, value) for name, value in assumed.items() if value]
        return premises([*((name, MEASURED, value) for name, value in told.items()), *entries])

    def details(self) -> str:
        """What was seen, what it says of the claim, and what that rests on, in sentences."""
        p = self.premises
        gone, failed = "", p["counted as failed"]
        if failed:
            gone = f" {failed:,} of them are rows that never came, each counted as failed."
        if "MISSING" in p:
            gone += (
                f" Rows that are not here, {text_of(p['MISSING'])}: nothing was bet on them. Those "
                "that failed may be among them, so silence says nothing of these; `closed` counts "
                "them as failed."
            )
        told = [e for e in p if e.standing == ASSUMED and e.name != "MISSING"]
        rests = ", ".join([*(f"{e.name}({text_of(e.value)})" for e in told), SAME])
        return (
            f"{'ALARM: the claim is refuted' if p['alarm'] else 'No alarm'}. Of {p['seen']}, "
            f"{text_of(p['laws'])}, {p['left']:,} left the tube; by the claim {p['claim']} each "
            f"does with probability at most {p['rate']}. The bets won {p['largest']} that ring, at "
            f"most.{gone} If the claim is true an alarm ever rings with probability at most "
            f"{p['alpha']}. Assumes: {rests}."
        )

    def closed(self) -> "Monitor":
        """The monitor where no more rows of its files come: those that are missing have failed.
        Raises InputError of recordings, since nobody knows of how many they are.
        """
        gone = sum(self.missing.values())
        if gone and self.claim.unit != RUNS:
            raise InputError(
                f"closed: expected runs, of which each row is one; {gone:,} rows of recordings are "
                "missing. Observe their logs with the runs that failed."
            )
        if gone and not self.claim.tube.claimed.all():
            raise InputError(
                "closed: expected a claim about every bin of K; of this one nobody knows which of "
                f"{gone:,} missing rows are in bins without a claim, of which it says nothing."
            )
        state = replace(self, missing=dict.fromkeys(self.missing, 0), failed=self.failed + gone)
        for _ in range(gone):
            state = state.bet(True)
        return state

    def observe(self, batch: RolloutBatch) -> "Monitor":
        """The monitor after the runs of the batch, one by one in order. A failed run has left the
        tube; of a claim about recordings a group counts as one, with its worst run, or one drawn
        where a law of k was declared, which is of one run. Raises InputError for runs without new
        evidence (those the claim was made from, runs or recordings observed before), for another
        unit or law of k than the claim's, and for records that refute its bound on motion. Not
        seen: k without names in another order than the claim's.
        """
        check_kind("observe", batch, RolloutBatch)
        left = ~inside_tube(self.claim, self.net, batch)
        check_between(intersample_of(self.claim.assumptions), batch, moves_of(batch))
        require_unit(self.claim, batch)
        law, own = batch.law.of(batch.k), self.claim.law
        elsewhere = own.draws_on_box and (law.lo, law.hi) != (own.lo, own.hi)
        elsewhere |= law.lacks(self.claim.domain)
        if not self.declared and (law.k_law != own.k_law or elsewhere):
            got = f"{law.how_drawn}{', on another K' if elsewhere else ''}"
            raise InputError(
                f"{batch.name}: expected k drawn as those of the claim, k {own.how_drawn}; got k "
                f"{got}. Declare it: monitor(claim, net, share=s), of a set that the claim's law "
                "enters with probability s, 1.0 where both laws are one."
            )
        state = _with_new(self, batch)
        each = worst_by_group(left, batch.groups)
        if self.declared:  # as the law is: of one run of each, the last in a random order
            order = np.random.default_rng(self.seen).permutation(batch.n)
            each = left[np.argsort(order)[worst_by_group(order, batch.groups)]]
        for outside in each:
            state = state.bet(bool(outside))
        return state

    def bet(self, outside: bool | None, followed: float = 1.0) -> "Monitor":
        """The monitor after one run that stayed inside or left the tube. Raises InputError.

        outside: None where nobody knows, as within what poses are uncertain by. It is no win: left
        out, runs that left would be more among the others than the claim allows.
        followed: share of its time that was driven, as `Shield` tells it; of the rest nothing is
            known where another took over, which the sentence says.
        """
        told = outside is None or getattr(outside, "dtype", type(outside)) in (bool,)
        if not told or np.ndim(outside):
            raise InputError(f"bet: expected True, False, None: did it leave? Got {outside!r:.60}.")
        if (share := at_least("bet: followed", followed)) > 1:
            raise InputError(f"bet: expected followed, a share up to 1; got {followed!r:.60}.")
        bets, rate, cut = self.bets, self.rate, share < 1 and outside in (False,)
        gain = np.log(bets / rate) if outside else np.log1p(-bets) - np.log1p(-rate)
        wealth = self.log_wealth + gain
        after = replace(self, log_wealth=wealth, seen=self.seen + 1, left=self.left + bool(outside))
        after = replace(after, cut=self.cut + cut, followed=self.followed + cut * share)
        after = replace(after, unknown=self.unknown + (outside is None))
        return replace(after, peak=max(self.peak, after.e_value))


def monitor(claim: ErrorClaim, net: ReLUNetwork, alpha: float = 1e-3, **law) -> Monitor:
    """A fresh monitor of a claim. law: of the driven k, as in `ErrorClaim.risk`, but no bin, in
    which nobody looks for them; by default that of the claim's runs.

    Each bet is a likelihood ratio of a fixed larger rate against the claimed one: its wealth is a
    supermartingale whenever every run, given the past, leaves the tube with probability <= rate.
    Raises InputError when the claim has no rate.
    """
    check_network(claim, net)
    alpha = float(as_probability("alpha", alpha))
    if "bin" in law:
        raise InputError("monitor: expected share or density; got bin. Leave it out: share=s.")
    risk = claim.risk(**law or {"share": claim.claimed_share})
    if isinstance(risk, NoStatement):
        raise InputError(f"monitor: expected a claim with a probability; {risk.reason}.")
    rate = max(float(risk.bound), 1e-9)
    if rate >= 0.5:
        raise InputError(
            f"monitor: expected a rate below 1/2; got {rounded_up(rate, 3)}: nothing to refute."
        )
    bets = np.geomspace(1.5 * rate, 0.75, _BETS)
    start, told = np.zeros(_BETS), ", ".join(f"{name} = {value}" for name, value in law.items())
    one = ", of one run drawn from each" if claim.unit != RUNS else ""
    declared = f"k as declared: {told}{one}" if law else ""
    return Monitor(claim, net, rate, alpha, bets, start, declared=declared, of=claim.hash)


def inside_tube(claim: ErrorClaim, net: ReLUNetwork, batch: RolloutBatch) -> np.ndarray:
    """(n,) bool: runs within the tube at all records, as of `kept`."""
    check_network(claim, net)
    _require_same_robot(claim, batch)
    slack = allowance(net, batch.domain, claim.tube.layout)
    return in_chunks(
        batch.n,
        chunk_size(batch.n),
        lambda rows: kept(net, slack, claim, batch.k[rows], batch.p[rows], batch.q[rows]),
    )


def _with_new(watch: Monitor, batch: RolloutBatch) -> Monitor:
    """The monitor with the identity of new runs. Raises InputError for runs counted before."""
    require_new(watch.claim, batch)
    require_failed(batch.name, batch.law)
    ids = batch.hashes().tolist()
    again = len(ids) - len(set(ids) - watch.ids)
    again = max(again, int(repeated(batch, watch.marks).sum()))  # in another storage or frame
    if again:
        raise InputError(
            f"{batch.name}: expected each run once; {again} of {batch.n} occur twice or were "
            "observed before. Leave them out: they are no new evidence."
        )
    groups = frozenset([] if batch.groups is None else batch.groups.tolist())
    log, first, last = joined_source([batch])
    source = batch.name, log or f"{batch.seed} {batch.stage}"  # two files may have one name
    shared, sources = len(groups & watch.groups), {*watch.spans, source}
    if shared or (len(sources) > 1 and min(groups | watch.groups, default=NAMED) < NAMED):
        why = f"{shared} were observed before" if shared else "numbers of several files"
        raise InputError(
            f"{batch.name}: expected recordings that differ from those observed before; got {why}. "
            "Observe all runs of a recording at once, and give each its name: groups of texts."
        )
    # of a file in parts, those of its rows that come later are no more missing
    gone = left_out_beside(watch.claim, batch)
    if source in watch.spans:
        begin, end = watch.spans[source]
        first, last = min(first, begin), max(last, end)
        gone = watch.missing[source] + (last - first) - (end - begin) - batch.n
    if gone < 0:
        raise InputError(
            f"{batch.name}: expected rows that are missing so far; {-gone:,} more came, since they "
            "were observed before, or counted as failed by `closed`."
        )
    about = {
        "groups": watch.groups | groups,
        "spans": {**watch.spans, source: (first, last)},
        "missing": {**watch.missing, source: gone},
        "lost": (*watch.lost, *lost_among(batch.lost).values()),
        "unnamed": watch.unnamed or watch.claim.subject.unordered(batch.subject),
        "logs": watch.logs or batch.seed is None,
        "laws": watch.laws | {f"drawn from {batch.law.of(batch.k).describe()}"},
    }
    seen = {"ids": watch.ids | set(ids), "marks": watch.marks.union(marks_by_k(batch.k))}
    return replace(watch, **seen, **about)


def require_unit(claim: ErrorClaim, batch: RolloutBatch) -> None:
    """Refuse runs counted by another unit than the claim's. Raises InputError."""
    unit = RUNS if batch.groups is None else RECORDINGS
    if unit != claim.unit:
        how = "Name the recording of each: groups=." if unit == RUNS else "Leave groups out."
        told = f"expected {claim.unit.many}, as the claim counts; got {unit.many}"
        raise InputError(f"{batch.name}: {told}. {how}")


def require_new(claim: ErrorClaim, batch: RolloutBatch) -> None:
    """Refuse runs that a claim was made from, in any way. Raises InputError."""
    made = used_by(claim, batch)
    if (old := made != "").any():
        uses = zip(*np.unique(made[old], return_counts=True), strict=True)
        told = " and ".join(f"{n} of {batch.n} are its {use} runs" for use, n in uses)
        raise InputError(
            f"{batch.name}: expected runs made after the claim; "
            f"{'at least ' * (not old.all())}{told}, the first is row {batch.rows[old][0]}. Runs "
            "of logs as near in k and end as copies count as these. Leave them out, with parts of "
            "their recordings, which are known by name (give others other names: groups=, or "
            "files of bags), or draw new ones, of other k where feedback makes ends alike."
        )


def _require_same_robot(claim: ErrorClaim, batch: RolloutBatch) -> None:
    """Refuse runs outside of the claim. Raises InputError."""
    about, runs = claim.subject, batch.subject
    logs = [one for one in (about, runs) if one.system.startswith(LOG)]
    silent = not all(one.given for one in logs)  # a log need not say what was measured
    free = STATED if silent else STATED[:-1] if logs else ()
    where = f"{batch.name}: runs of the claim about {about.system}"
    about.agree(where, runs, ("K", *free))
    cuts = claim.law.cut, batch.law.cut
    if all(cut.entries for cut in cuts):  # runs of a simulator are not cut out of anything
        agree(where, *cuts)
    outside = ~about.domain.contains(batch.k)
    outside[~outside] = ~claim.tube.claimed[claim.tube.bins_of(batch.k[~outside])].all(axis=1)
    if outside.any():
        raise InputError(
            f"{batch.name}: expected k within the K of the claim, in bins that have a claim; "
            f"{int(outside.sum())} of {batch.n} runs are outside, the first is row "
            f"{batch.rows[np.argmax(outside)]}. The claim says nothing of them: leave them out, "
            "and do not use `closed`, which counts them as failed."
        )
