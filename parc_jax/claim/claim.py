"""What is claimed about the model's error, in words and numbers that say no more than what was
shown.
"""

import json
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path

from parc_jax.claim.risk import (
    Density,
    NoStatement,
    Point,
    Risk,
    Uniform,
    density_of_share,
    risk_of,
)
from parc_jax.claim.statement import decimal, statement
from parc_jax.claim.tube import Tube, refined
from parc_jax.claim.tube_file import tube_from_json, tube_to_json
from parc_jax.claim.unit import RECORDED_ROWS, RECORDINGS, RUNS, Unit
from parc_jax.errors import InputError
from parc_jax.rollout.files import write_atomic
from parc_jax.rollout.law import LawSpec
from parc_jax.spelling import hex_text, nearest_floats

KINDS = ("pac", "conformal", "cover", "assumed", "declared")
FORMAT = "parc_jax.claim/1"


@dataclass(frozen=True, eq=False)
class ErrorClaim:
    """A tube and exactly what is known about it. Made by `bound_error`, `calibrate`, `cover_claim`,
    `assumed_claim`, `declared_claim`, all through `error_claim`.

    kind: one of
        "pac"       with confidence 1 - delta, a new run leaves the tube with probability <= eps.
                    [T1, T2]
        "conformal" over holdout and new run together, it leaves with probability <= eps. [T2]
        "cover"     no run leaves the tube, if the declared constants are right. [T7]
        "assumed"   nothing is shown; the published maximum over training data.
        "declared"  nothing is shown here; the bound comes from elsewhere.
    tube: half widths; a bin with infinite widths has no claim (`tube.claimed`).
    quantifier: the law of runs that the claim speaks of, in words; of a declared one, the reason.
    eps, delta: exact; None where the kind has none.
    n, discard, looks: runs that support it, runs discarded (fixed beforehand), times this holdout
        has been looked at.
    law: where those runs came from.
    assumptions: ledger of identifiers. evidence: JSON-able record (hashes of network and tube,
        seeds, largest scores, search).
    bin_eps: per-bin claims: one eps per bin, None for a bin without claim [T4]; else None.
    intersample: (n_p,) [m] part of the interval widths that covers the time between records. [T9]
    """

    kind: str
    tube: Tube
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

    def __repr__(self) -> str:
        known = {"eps": self.eps, "delta": self.delta}
        numbers = [f"{name} {decimal(v)}" for name, v in known.items() if v is not None]
        shown = (
            f"{self.n:,} {self.unit.many} of {self.law.generator}" if self.n else self.quantifier
        )
        return f"ErrorClaim({', '.join([self.kind, *numbers, shown])}, {self.tube})"

    @property
    def unit(self) -> Unit:
        """What n counts."""
        return RECORDINGS if RECORDED_ROWS in self.evidence else RUNS

    def statement(self) -> str:
        """The claim in full sentences. Never claims more than the kind allows."""
        return statement(self)

    def risk(self, nu: Uniform | Density | Point) -> Risk | NoStatement:
        """What the claim promises when k is drawn by the law nu. [T5] A single hand-picked k gets
        no statement.
        """
        if self.kind in ("assumed", "declared"):
            return NoStatement(
                f"the tube is {self.kind}, not shown; calibrate it on a fresh holdout (bound_error)"
            )
        if not self.tube.claimed.any():
            return NoStatement("no bin of K has a claim")
        if self.kind == "cover":
            return Risk(Fraction(0), Fraction(0))
        if self.evidence.get("not_drawn"):
            return NoStatement(
                f"{', '.join(self.evidence['not_drawn'])} are not drawn, and the claim is about k "
                "drawn from all of K"
            )
        if isinstance(nu, Point):
            return NoStatement(
                "a probability over k says nothing about one k; draw k from a certified set, or "
                "run validate_choice"
            )
        if self.kind == "conformal":
            return NoStatement(
                "a marginal claim does not survive the choice of a set after calibration; use kind "
                "pac"
            )
        if isinstance(nu, Density):
            by_bin = self.bin_eps or (self.eps,)
            if None in by_bin:
                return NoStatement(
                    "some bins of K have no claim, and k of this law may fall into them"
                )
            # the bins' parts of P(leave) add up to at most bound * (sum over bins of Pi(b) eps_b)
            return risk_of(max(by_bin), self.delta, Fraction(str(nu.bound)), nu.shift)
        if not isinstance(nu, Uniform):
            raise InputError(f"risk: expected Uniform, Density or Point; got {type(nu).__name__}.")
        return self._risk_uniform(nu)

    def to_json(self) -> dict:
        """A JSON-able dictionary, the tube left out (it has a place of its own in every file);
        numbers are strings.
        """
        return {
            "format": FORMAT,
            "kind": self.kind,
            "statement": self.statement(),
            "quantifier": self.quantifier,
            "eps": _spell(self.eps),
            "delta": _spell(self.delta),
            "n": self.n,
            "discard": self.discard,
            "looks": self.looks,
            "law": {
                "generator": self.law.generator,
                "parameters": [list(pair) for pair in self.law.parameters],
                "k_law": self.law.k_law,
                "lo": list(self.law.lo),
                "hi": list(self.law.hi),
                "hash": self.law.hash,
            },
            "assumptions": list(self.assumptions),
            "evidence": self.evidence,
            "bin_eps": None if self.bin_eps is None else [_spell(e) for e in self.bin_eps],
            "intersample": hex_text(self.intersample),
        }

    def save(self, path) -> Path:
        """Claim and tube in one JSON file, atomically. `load_claim` gives back equal numbers."""
        data = {"claim": self.to_json(), "tube": tube_to_json(self.tube)}
        return write_atomic(path, json.dumps(data, indent=1).encode())

    def _risk_uniform(self, nu: Uniform) -> Risk | NoStatement:
        if self.bin_eps is None:
            return risk_of(self.eps, self.delta, density_of_share(nu.share), nu.shift)
        claimed = [eps for eps in self.bin_eps if eps is not None]
        if nu.bin is None:  # sum over bins of Pi(b) eps_b is at most the largest eps
            return risk_of(max(claimed), self.delta, density_of_share(nu.share), nu.shift)
        if self.bin_eps[nu.bin] is None:
            return NoStatement(f"bin {nu.bin} holds too few runs: no claim")
        if self.evidence["bin_share"] is None:
            return NoStatement("k was not uniform on K: the probability of a bin is not known")
        whole = Fraction(self.evidence["bin_share"][nu.bin])
        return risk_of(
            self.bin_eps[nu.bin], self.delta, density_of_share(nu.share, whole), nu.shift
        )


def claim_from_json(data: dict, error_tube: Tube) -> ErrorClaim:
    """The claim of `to_json`, about the given tube. Raises InputError on missing or foreign
    fields, and when it was made about another tube.
    """
    try:
        if data["format"] != FORMAT or data["kind"] not in KINDS:
            raise InputError(
                f"claim: expected format {FORMAT}, kind one of {KINDS}; got {data['format']}, "
                f"{data['kind']}."
            )
        law = data["law"]
        pairs = tuple((name, value) for name, value in law["parameters"])
        claim = ErrorClaim(
            kind=data["kind"],
            tube=error_tube,
            quantifier=data["quantifier"],
            eps=_parse(data["eps"]),
            delta=_parse(data["delta"]),
            n=data["n"],
            discard=data["discard"],
            looks=data["looks"],
            law=LawSpec(law["generator"], pairs, law["k_law"], tuple(law["lo"]), tuple(law["hi"])),
            assumptions=tuple(data["assumptions"]),
            evidence=data["evidence"],
            bin_eps=None if data["bin_eps"] is None else tuple(_parse(e) for e in data["bin_eps"]),
            intersample=tuple(nearest_floats(data["intersample"])),
        )
        check_tube(claim)
        return claim
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(
            f"claim: expected the fields of ErrorClaim.to_json; {type(error).__name__}: {error}."
        ) from None


def load_claim(path) -> ErrorClaim:
    """A claim written by `ErrorClaim.save`. Raises InputError when the file is missing, truncated
    or foreign.
    """
    try:
        data = json.loads(Path(path).read_text())
        return claim_from_json(data["claim"], tube_from_json(data["tube"]))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file.") from None
    except (json.JSONDecodeError, KeyError, TypeError) as error:
        raise InputError(
            f"{path}: expected a complete claim file; got {type(error).__name__}: {error}."
        ) from None


def error_claim(**fields) -> ErrorClaim:
    """A claim bound to its tube: the evidence names its hash. Fields as in `ErrorClaim`."""
    claim = ErrorClaim(**fields)
    return replace(claim, evidence=claim.evidence | {"tube": claim.tube.hash})


def check_tube(claim: ErrorClaim) -> None:
    """Refuse a claim beside another tube than the one it was made about. Raises InputError.

    Claims of files that are older than this binding name no tube, and pass.
    """
    made_about = claim.evidence.get("tube")
    if made_about is not None and made_about != claim.tube.hash:
        raise InputError(
            f"claim: expected the tube that it was made about ({made_about[:12]}); got another one "
            f"({claim.tube.hash[:12]}). Widths or bins have changed; bound the error anew."
        )


def weaker(claim: ErrorClaim, wider: Tube, **evidence) -> ErrorClaim:
    """The same claim with a tube at least as wide everywhere: every label stays true. [T8] Raises
    InputError.
    """
    if not wider.at_least(claim.tube):
        raise InputError(
            "claim: a claim survives a wider tube only; the new one is narrower somewhere."
        )
    return _about(claim, wider, **evidence)


def on_bins(claim: ErrorClaim, edges) -> ErrorClaim:
    """The same claim told bin by bin on finer edges: models on the same bins share compiled code.
    Raises InputError.
    """
    return _about(claim, refined(claim.tube, edges))


def _about(claim: ErrorClaim, other: Tube, **evidence) -> ErrorClaim:
    return replace(claim, tube=other, evidence=claim.evidence | evidence | {"tube": other.hash})


def _spell(value: Fraction | None) -> str | None:
    return None if value is None else str(value)


def _parse(text: str | None) -> Fraction | None:
    return None if text is None else Fraction(text)
