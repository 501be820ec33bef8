"""What is claimed about the model's error, in words and numbers that say no more than what was shown."""

import json
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from parc_jax.error.risk import Density, NoStatement, Point, Risk, Uniform, density_of_share, risk_of
from parc_jax.error.tube import Tube, tube
from parc_jax.errors import InputError
from parc_jax.rollout.files import write_atomic
from parc_jax.rollout.law import LawSpec

KINDS = ("pac", "conformal", "cover", "assumed")
FORMAT = "parc_jax.claim/1"


@dataclass(frozen=True, eq=False)
class ErrorClaim:
    """A tube and exactly what is known about it. Made by `bound_error`, `calibrate`, `cover_claim`, `assumed_claim`.

    kind:        "pac"       with confidence 1 - delta, a new run leaves the tube with probability <= eps      [T1, T2]
                 "conformal" over holdout and new run together, it leaves the tube with probability <= eps     [T2]
                 "cover"     no run leaves the tube, if the declared constants are right                       [T7]
                 "assumed"   nothing is shown; the published maximum over training data
    tube:        half widths; a bin with infinite widths has no claim (`tube.claimed`).
    quantifier:  the law of runs that the claim speaks of, in words.
    eps, delta:  exact; None where the kind has none.
    n, discard, looks: runs that support it, runs discarded (fixed beforehand), times this holdout has been looked at.
    law:         where those runs came from.
    assumptions: ledger of identifiers. evidence: JSON-able record (hashes, seeds, largest scores, search).
    bin_eps:     per-bin claims: one eps per bin, None for a bin without claim [T4]; else None.
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

    def statement(self) -> str:
        """The claim in full sentences. Never claims more than the kind allows."""
        if not self.tube.claimed.any():
            failed = self.evidence.get("failed", 0)
            return (
                f"No claim: {failed:,} of {self.n:,} runs failed, with {self.discard} discards fixed beforehand, so no "
                "finite tube holds. Repair the system, shrink K, or calibrate on new runs with more discards."
            )
        return " ".join([_HEAD[self.kind](self), *_missing(self), f"Assumes: {', '.join(self.assumptions)}."])

    def risk(self, nu: Uniform | Density | Point) -> Risk | NoStatement:
        """What the claim promises when k is drawn by the law nu. [T5] A single hand-picked k gets no statement."""
        if self.kind == "assumed":
            return NoStatement("the tube is assumed, not shown; calibrate it on a fresh holdout (bound_error)")
        if not self.tube.claimed.any():
            return NoStatement("no bin of K has a claim")
        if self.kind == "cover":
            return Risk(Fraction(0), Fraction(0))
        if isinstance(nu, Point):
            return NoStatement(
                "a probability over k says nothing about one k; draw k from a certified set, or run validate_choice"
            )
        if self.kind == "conformal":
            return NoStatement("a marginal claim does not survive the choice of a set after calibration; use kind pac")
        if isinstance(nu, Density):
            by_bin = self.bin_eps or (self.eps,)
            if None in by_bin:
                return NoStatement("some bins of K have no claim, and k of this law may fall into them")
            # claims by bin: the bins' parts of P(leave) add up to at most bound * sum of Pi(b) eps_b
            return risk_of(max(by_bin), self.delta, Fraction(str(nu.bound)), nu.shift)
        if not isinstance(nu, Uniform):
            raise InputError(f"risk: expected Uniform, Density or Point; got {type(nu).__name__}.")
        return self._risk_uniform(nu)

    def to_json(self) -> dict:
        """A JSON-able dictionary, the tube left out (it has a place of its own in every file); numbers are strings."""
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
            "intersample": [float(v).hex() for v in self.intersample],
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
        return risk_of(self.bin_eps[nu.bin], self.delta, density_of_share(nu.share, whole), nu.shift)


def claim_from_json(data: dict, error_tube: Tube) -> ErrorClaim:
    """The claim of `to_json`, about the given tube. Raises InputError on missing or foreign fields."""
    try:
        if data["format"] != FORMAT or data["kind"] not in KINDS:
            raise InputError(
                f"claim: expected format {FORMAT}, kind one of {KINDS}; got {data['format']}, {data['kind']}."
            )
        law = data["law"]
        pairs = tuple((name, value) for name, value in law["parameters"])
        return ErrorClaim(
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
            intersample=tuple(float.fromhex(v) for v in data["intersample"]),
        )
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(
            f"claim: expected the fields of ErrorClaim.to_json; {type(error).__name__}: {error}."
        ) from None


def load_claim(path) -> ErrorClaim:
    """A claim written by `ErrorClaim.save`. Raises InputError when the file is missing, truncated or foreign."""
    try:
        data = json.loads(Path(path).read_text())
        return claim_from_json(data["claim"], tube_from_json(data["tube"]))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file.") from None
    except (json.JSONDecodeError, KeyError, TypeError) as error:
        raise InputError(f"{path}: expected a complete claim file; got {type(error).__name__}: {error}.") from None


def tube_to_json(error_tube: Tube) -> dict:
    """Edges and widths as nested lists of hex floats ("inf" in bins without claim)."""
    return {
        "edges": [_hex(e) for e in error_tube.edges],
        "interval": _hex(error_tube.interval),
        "final": _hex(error_tube.final),
    }


def tube_from_json(data: dict) -> Tube:
    """The tube of `tube_to_json`."""
    return tube([_unhex(e) for e in data["edges"]], _unhex(data["interval"]), _unhex(data["final"]))


def weaker(claim: ErrorClaim, wider: Tube, **evidence) -> ErrorClaim:
    """The same claim with a tube at least as wide everywhere: every label stays true. [T8] Raises InputError."""
    if not ((wider.interval >= claim.tube.interval).all() and (wider.final >= claim.tube.final).all()):
        raise InputError("claim: a claim survives a wider tube only; the new one is narrower somewhere.")
    return replace(claim, tube=wider, evidence=claim.evidence | evidence)


def _pac(c: ErrorClaim) -> str:
    asked = c.evidence.get("eps_asked")
    short = f" ({asked} was asked; {c.n:,} runs do not support it.)" if asked else ""
    by_bin = "" if c.bin_eps is None else " (the largest over the bins of K, each bin with its own)"
    return (
        f"With confidence {_decimal(1 - c.delta)} over the {c.n:,} calibration rollouts, {c.quantifier} leaves the "
        f"tube at any time with probability at most {_decimal(c.eps)}{by_bin}, in every environment.{short} "
        f"For k drawn at random from a certified set of share s of K: at most {_decimal(c.eps)}/s. "
        "For a single hand-picked k: no probabilistic statement."
    )


def _conformal(c: ErrorClaim) -> str:
    return (
        f"Over the draw of the {c.n:,} calibration rollouts and of a new one together, "
        f"{c.quantifier} leaves the tube at any time with probability at most {_decimal(c.eps)}. "
        "This marginal claim does not hold for a k or a set chosen afterwards."
    )


def _cover(c: ErrorClaim) -> str:
    return f"No run leaves the tube: {c.quantifier}, shown on a cover of K by {c.n:,} runs and the declared constants."


def _assumed(c: ErrorClaim) -> str:
    return (
        f"ASSUMED, not shown: that no run leaves the tube. It is the largest error over the {c.n:,} training rollouts, "
        "the statistic of the published method; new rollouts are known to leave such a tube."
    )


_HEAD = {"pac": _pac, "conformal": _conformal, "cover": _cover, "assumed": _assumed}


def _missing(c: ErrorClaim) -> list[str]:
    without = int((~c.tube.claimed).sum())
    return [f"{without} of {c.tube.n_bins} bins of K have no claim."] if without else []


def _spell(value: Fraction | None) -> str | None:
    return None if value is None else str(value)


def _parse(text: str | None) -> Fraction | None:
    return None if text is None else Fraction(text)


def _decimal(value: Fraction) -> str:
    return f"{float(value):.10g}"


def _hex(values):
    values = np.asarray(values)
    return float(values).hex() if values.ndim == 0 else [_hex(v) for v in values]


def _unhex(values) -> np.ndarray:
    def walk(v):
        return [walk(x) for x in v] if isinstance(v, list) else float.fromhex(v)

    return np.array(walk(values), np.float64)
