"""Error bounds of a model: numbers, and words that say no more than was shown."""

import hashlib
import json
from dataclasses import asdict, dataclass, field, replace
from fractions import Fraction

import numpy as np

from parc_jax.checker.claim import words_of
from parc_jax.common.arrays import Sealed, once
from parc_jax.common.errors import InputError, check_kind, check_text
from parc_jax.common.premises import Premises
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import exact, hex_text, listed, nearest_floats, plain, rounded_up
from parc_jax.learning.bound.bins import block_shares
from parc_jax.learning.bound.counts import (
    RECORDED_IDS,
    RECORDED_ROWS,
    RECORDINGS,
    RUNS,
    NoStatement,
    Risk,
    Unit,
    as_fraction,
    density_of,
    density_of_share,
    risk_of,
)
from parc_jax.learning.bound.statement import DIGITS, VALIDATED, premises_of, statement
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.law import PART, LawSpec, Subject, logged_on, told_of_part

ROUNDED = 1e-9  # [of itself] by which a share in decimals may be above that of float edges
FORMAT = "parc_jax.claim/3"


@dataclass(frozen=True, eq=False)
class ErrorClaim(Sealed):
    """A tube and its error bound (PAC, or none). Made by `bound_error`, `calibrate`,
    `assumed_claim`, `declared_claim`, all through `error_claim`.

    kind: one of
        "pac"       with confidence 1 - delta, a new run leaves the tube with probability <= eps.
                    [T1, T2]
        "assumed"   nothing is shown; the published maximum over training data.
        "declared"  nothing is shown here; the bound comes from elsewhere.
        "validated" with confidence 1 - delta, a plan drawn from one set in one scene fails with
                    probability <= eps; of the tube, which is narrower, nothing is shown. [T42]
    tube: set of errors; a bin with infinite widths has no claim (`tube.claimed`).
    subject: of the runs: system, K, time grid, points in order, rotation.
    network: its hash.
    quantifier: the law of runs in words; of a declared claim, the reason.
    eps, delta: exact; None where the kind has none.
    n, discard, looks: runs that support it, runs discarded (fixed beforehand), uses of these.
    law: of those runs.
    assumptions: ledger of identifiers. evidence: JSON-able record (hashes of profile and
        calibration set, seeds, largest scores).
    bin_eps: per-bin claims: one eps per bin, None for a bin without claim [T4]; else None.
    intersample: (n_p,) [m] part of the interval widths that covers the time between records. [T9]
    hash: of all of this together. `check_claim` refuses a claim with a part from elsewhere.
    """

    kind: str
    tube: Tube
    subject: Subject
    network: str
    quantifier: str
    eps: Fraction | None
    delta: Fraction | None
    n: int
    discard: int
    looks: int
    law: LawSpec
    assumptions: tuple[str, ...]
    evidence: dict = field(default_factory=dict)
    bin_eps: tuple[Fraction | None, ...] | None = None
    intersample: tuple[float, ...] = ()
    hash: str = ""

    @property
    def domain(self) -> Box:
        """K, or the box of k that the claim is about."""
        return self.subject.domain

    def __repr__(self) -> str:
        pairs = (("eps", self.eps), ("delta", self.delta))
        numbers = [f"{name} {rounded_up(v, DIGITS)}" for name, v in pairs if v is not None]
        shown = (
            f"{self.n:,} {self.unit.many} of {self.law.generator}" if self.n else self.quantifier
        )
        return f"ErrorClaim({', '.join([self.kind, *numbers, shown])}, {self.tube})"

    @property
    def unit(self) -> Unit:
        """Independent unit that n counts."""
        return RECORDINGS if {RECORDED_ROWS, RECORDED_IDS} & self.evidence.keys() else RUNS

    @property
    def premises(self) -> Premises:
        """Premises of its sentences, with its numbers. Raises InputError, as of `check_claim`."""
        once(self, check_claim)
        return premises_of(self)

    def details(self) -> str:
        """The claim in full sentences. Never claims more than the kind allows."""
        return statement(self.premises)

    def risk(
        self,
        *,
        share: float | Fraction | None = None,
        density: float | Fraction | None = None,
        bin: int | None = None,
        shift: float = 0.0,
        claimed: bool = False,
    ) -> Risk | NoStatement:
        """Probability that a run leaves the tube when k is drawn in a certain way. [T5]

        share: k is drawn by the law of the claim's runs restricted to a set of bins that have a
            claim, which that law enters with this probability; vol(set) / vol(K) where uniform.
        density: k is drawn by any law that is at most so many times as dense as the claim's.
        Neither: one k, picked by hand or by a planner. Nothing is promised of it.
        claimed: a law of this density draws from bins with a claim alone, as `Answer.sample` does.
        bin: the set lies in this bin, of a claim per bin; share stays that of all of K.
        shift: total variation between the declared and the deployed law of (k, disturbance), k
            drawn so: tau of all of K's runs, which may fall into the set alone, is tau / share.
        Of a claim about recordings all of it is about one run, drawn from each. Raises InputError.
        """
        once(self, check_claim)
        share = None if share is None else as_fraction("share", share)
        given = [x is not None for x in (share, density, bin)]
        if given[:2] == [True, True] or given[::2] == [False, True]:
            raise InputError("risk: expected share, with or without bin, or density; got more.")
        if bin is not None and not (type(bin) is int and 0 <= bin < self.tube.n_bins):
            raise InputError(f"bin: expected one of {self.tube.n_bins}, from 0 on; got {bin!r}.")
        if self.kind in ("assumed", "declared"):
            return NoStatement(
                f"the tube is {self.kind}, not shown; calibrate it on a fresh holdout (bound_error)"
            )
        if self.kind == VALIDATED:
            return NoStatement("it is about one set in one scene, and its answer has its risk")
        if not self.tube.claimed.any():
            return NoStatement("no bin of K has a claim")
        if names := self.evidence.get("not_drawn"):
            of = f"and this is of {listed(names)}"
            return NoStatement(f"the claim is about k drawn from all of K, {of}")
        if share is not None:
            return self._risk_within(share, bin, shift)
        if density is None:
            return NoStatement(
                "a probability over k says nothing about one k; draw k from a certified set, or "
                "run the plan afresh (Choice.test)"
            )
        by_bin = self.bin_eps or (self.eps,)
        known = [eps for eps in by_bin if eps is not None]
        if len(known) < len(by_bin) and not (known and claimed):
            return NoStatement("some bins of K have no claim, and k of this law may fall into them")
        # the bins' parts of P(leave) add up to at most density * (sum over bins of Pi(b) eps_b)
        return risk_of(max(known), self.delta, density_of(density), shift)

    def to_json(self) -> dict:
        """A JSON-able dictionary; the tube has a place of its own in files; numbers are strings."""
        return self.facts() | {"statement": self.details(), "hash": self.hash}

    def facts(self) -> dict:
        """All parts of its hash but the tube; both checkers read premises from these."""
        by_bin = None
        if self.bin_eps is not None:
            by_bin = [None if eps is None else str(eps) for eps in self.bin_eps]
        return {
            "format": FORMAT,
            "kind": self.kind,
            "subject": self.subject.to_json(),
            "network": self.network,
            "quantifier": self.quantifier,
            "eps": None if self.eps is None else str(self.eps),
            "delta": None if self.delta is None else str(self.delta),
            "n": self.n,
            "discard": self.discard,
            "looks": self.looks,
            "law": plain(asdict(self.law)) | {"hash": self.law.hash},
            "assumptions": list(self.assumptions),
            "evidence": self.evidence,
            "bin_eps": by_bin,
            "intersample": hex_text(self.intersample),
        }

    @property
    def claimed_share(self) -> Fraction:
        """Probability of a bin with a claim, by the law of its runs; one where it is not known."""
        if self.bin_eps is None or self.evidence.get("bin_share") is None:
            return Fraction(1)
        bins = np.arange(self.tube.n_bins)  # shares in evidence are of blocks, each once per bin
        both = zip(block_shares(self.tube.edges, bins), self.bin_eps, strict=True)
        return sum((share for share, eps in both if eps is not None), Fraction(0))

    def _risk_within(self, share: Fraction, bin: int | None, shift: float) -> Risk | NoStatement:
        """Of k drawn by the claim's law within a set, which may lie in one bin."""
        if self.bin_eps is None:
            return risk_of(self.eps, self.delta, density_of_share(share), shift)
        if bin is None:  # sum over bins of Pi(b) eps_b is at most the largest eps
            eps, most = max(eps for eps in self.bin_eps if eps is not None), self.claimed_share
        elif (eps := self.bin_eps[bin]) is None:
            return NoStatement(f"bin {bin} holds too few runs: no claim")
        elif self.evidence["bin_share"] is None:
            return NoStatement("how probable this bin is by the law of k is not known")
        else:
            most = Fraction(self.evidence["bin_share"][bin])
        if share > most * (1 + Fraction(ROUNDED)):
            place = "bins claimed" if bin is None else f"bin {bin}"
            up_to = f"risk: expected a share up to {exact(float(most))}, of {place}"
            raise InputError(f"{up_to}; got {exact(float(share))}.")
        whole = Fraction(1) if bin is None else most
        return risk_of(eps, self.delta, density_of_share(min(share, most), whole), shift)


def error_claim(**fields) -> ErrorClaim:
    """A claim bound to its parts by `hash`. Fields as in `ErrorClaim`. Raises InputError where they
    do not fit, also for a K that is not the one of the law of runs.
    """
    return _bound(ErrorClaim(**fields))


def derived(claim: ErrorClaim, **changes) -> ErrorClaim:
    """The claim with other fields, such as a wider tube or a part of K, true by the caller's proof.
    Fields as in `ErrorClaim`; evidence is added. Of another K the law of runs stays, and says that
    K is a part of its box. Raises InputError.
    """
    evidence = claim.evidence | changes.pop("evidence", {})
    law, K = claim.law, changes.get("subject", claim.subject).domain
    if "law" not in changes and _corners(K) != _corners(claim.domain):
        changes["law"] = told_of_part(law)
        said = changes.get("quantifier", claim.quantifier)
        changes["quantifier"] = said.replace(law.describe(), changes["law"].describe())
    return _bound(replace(claim, evidence=evidence, **changes))


def scene_claim(claim: ErrorClaim, tube: Tube, law: LawSpec, evidence: dict, **shown) -> ErrorClaim:
    """The claim of tests of one set in one scene, for a tube scaled to `tube`. [T42]

    law: of the system that was run, or of the recordings that `evidence` names. shown: eps, delta,
    n tests in the set, `discard` failed ones, the assumptions of these runs.
    """
    if RECORDED_IDS in evidence:
        law = logged_on(law, claim.domain)
    else:
        at = ", ".join(map(exact, nearest_floats(evidence.get("at") or [])))
        start = f", all from ({at}) m in the scene's frame" if at else ""
        law = replace(law, k_law=f"a uniform draw from the set{start}")
    about = {"kind": VALIDATED, "looks": 1, "bin_eps": None, "evidence": evidence}
    found = replace(claim, tube=tube, law=law, **about, **shown)
    facts = found.facts()
    return _bound(replace(found, quantifier=words_of(facts, facts["law"])[0]))


def recorded(claim: ErrorClaim) -> bool:
    """Is it about a set that recordings tested?"""
    return claim.kind == VALIDATED and RECORDED_IDS in claim.evidence


def check_claim(claim: ErrorClaim) -> None:
    """Refuse a claim with a part from elsewhere. Raises InputError."""
    _check_parts(claim)
    if claim.hash != _hash(claim):
        raise InputError(
            "claim: expected the network, tube, K, time grid, points, rotation, law and numbers "
            f"that it was made about ({claim.hash[:12]}); got others ({_hash(claim)[:12]}). Bound "
            "the error anew."
        )
    _check_law(claim)


def check_network(claim: ErrorClaim, net: ReLUNetwork) -> None:
    """Refuse another network than the claim's, and as of `check_claim`. Raises InputError."""
    check_kind("claim", claim, ErrorClaim)
    check_kind("net", net, ReLUNetwork)
    once(claim, check_claim)
    if claim.network != net.hash:
        raise InputError(
            f"claim: expected the network its claim was measured on ({claim.network[:12]}); got "
            f"another one ({net.hash[:12]}). Bound the error of this network anew."
        )


def weaker(claim: ErrorClaim, wider: Tube, **evidence) -> ErrorClaim:
    """The claim with a tube nowhere narrower: every label stays true. [T8] Raises InputError."""
    if not wider.at_least(claim.tube):
        raise InputError("claim: it survives a wider tube only; the new one is narrower somewhere.")
    return derived(claim, tube=wider, evidence=evidence)


def check_edges(tube: Tube, domain: Box) -> None:
    """Refuse a tube, or a profile, whose bins do not span K. Raises InputError."""
    for axis, edge in enumerate(tube.edges):
        if edge[0] != domain.lo[axis] or edge[-1] != domain.hi[axis]:
            raise InputError(
                f"tube: expected bins that span K = {domain.text}; along axis {axis} they cover "
                f"[{exact(edge[0])}, {exact(edge[-1])}]. Make them on K, or run all of these."
            )


def _check_parts(claim: ErrorClaim) -> None:
    """Refuse a tube of another shape than the runs, and texts of several lines (InputError)."""
    for text in (claim.quantifier, *claim.assumptions):
        check_text("claim", text)
    tube, about = claim.tube, claim.subject
    known = {
        "intervals": (about.time.n_steps, tube.layout.n_steps),
        "reference points": (len(about.points), tube.layout.n_points),
        "axes of the workspace": (about.n_p, tube.n_p),
        "goal states": (about.n_q, tube.n_q),
        "axes of K": (about.domain.n, tube.n_k),
    }
    differ = [f"{a} {name}, got {b}" for name, (a, b) in known.items() if a != b]
    if differ:
        raise InputError(f"claim: expected a tube as its runs are: {'; '.join(differ)}.")
    check_edges(tube, about.domain)


def _check_law(claim: ErrorClaim) -> None:
    """Refuse a law of another K, unless it says so. Raises InputError."""
    law, K = claim.law, claim.domain
    if _corners(K) != (law.lo, law.hi) and not law.k_law.endswith(PART):
        raise InputError(
            f"claim: expected K = {K.text} to be that of the law of its runs, {law.describe()}; "
            "take domain and law of the same runs."
        )


def _bound(claim: ErrorClaim) -> ErrorClaim:
    _check_parts(claim)
    _check_law(claim)
    return replace(claim, hash=_hash(claim))


def _hash(claim: ErrorClaim) -> str:
    facts = claim.facts() | {"subject": claim.subject.identity}  # labels are for people
    about = [plain(facts), claim.tube.hash]  # as answers spell them
    return hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()


def _corners(domain: Box) -> tuple[tuple[str, ...], tuple[str, ...]]:
    return tuple(hex_text(domain.lo)), tuple(hex_text(domain.hi))
