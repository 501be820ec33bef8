"""Claims out of files: their numbers follow from each other, and their hash from all of them."""

from fractions import Fraction

from parc_jax.checker import Rejected
from parc_jax.checker.claim import checked_claim
from parc_jax.common.errors import InputError, reading
from parc_jax.common.spelling import nearest_floats
from parc_jax.learning.bound.claim import FORMAT, ErrorClaim, check_claim
from parc_jax.learning.bound.statement import VALIDATED
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.runs.law import LawSpec, subject_from_json

KINDS = ("pac", "assumed", "declared", VALIDATED)
_AS_THEY_ARE = "kind", "network", "quantifier", "n", "discard", "looks", "evidence", "hash"


def claim_from_json(data: dict, error_tube: Tube) -> ErrorClaim:
    """The claim of `to_json`, about the given tube. Raises InputError on missing or foreign
    fields, and when it was made about anything else.
    """
    with reading("claim", "the fields of ErrorClaim.to_json", Rejected):
        if data["format"] != FORMAT or data["kind"] not in KINDS:
            raise InputError(
                f"claim: expected format {FORMAT}, kind one of {KINDS}; got {data['format']}, "
                f"{data['kind']}."
            )
        law = data["law"]
        pairs = tuple((name, value) for name, value in law["parameters"])
        claim = ErrorClaim(
            **{name: data[name] for name in _AS_THEY_ARE},
            tube=error_tube,
            subject=subject_from_json(data["subject"]),
            eps=_parse(data["eps"]),
            delta=_parse(data["delta"]),
            law=LawSpec(law["generator"], pairs, law["k_law"], tuple(law["lo"]), tuple(law["hi"])),
            assumptions=tuple(data["assumptions"]),
            bin_eps=None if data["bin_eps"] is None else tuple(_parse(e) for e in data["bin_eps"]),
            intersample=tuple(nearest_floats(data["intersample"])),
        )
        check_claim(claim)
        _check_sum(data, error_tube)
    return claim


def _check_sum(data: dict, tube: Tube) -> None:
    """Refuse numbers of which one does not follow from the others. Raises InputError."""
    parts = {"network": data["network"], "tube": ""}
    told = data | {f"{name}_hash": x for name, x in parts.items()}
    try:
        known = checked_claim(told, parts, tube.n_bins)
        # of a tube without end more may have failed
        if data["kind"] == "pac" and tube.claimed.all() and not known["checked"]:
            raise Rejected(known["says"])
    except Rejected as why:
        raise InputError(
            f"claim: expected numbers that follow from its runs; {why}. Bound the error anew."
        ) from None


def _parse(text: str | None) -> Fraction | None:
    return None if text is None else Fraction(text)
