"""What a claim says, what it refuses to say, and how it travels."""

import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from parc_jax.claim.claim import (
    check_tube,
    claim_from_json,
    error_claim,
    load_claim,
    on_bins,
    weaker,
)
from parc_jax.claim.risk import Density, NoStatement, Point, Uniform
from parc_jax.claim.tube import tube
from parc_jax.claim.tube_file import tube_from_json, tube_to_json
from parc_jax.errors import InputError
from parc_jax.rollout.law import law_spec
from parc_jax.sets.box import box

pytestmark = pytest.mark.soundness
LAW = law_spec("toy", box([0, 0], [1, 1]), parameters={"wind": 0.5})
TUBE = tube([[0, 0.1 + 0.2, 1], [0, 1]], np.full((2, 3, 2), 0.1), np.full((2, 3), 1 / 3))


def claim(kind="pac", **changes):
    fields = {
        "kind": kind,
        "tube": TUBE,
        "quantifier": "a new rollout drawn from toy",
        "eps": None if kind in ("assumed", "cover") else Fraction(1, 1000),
        "delta": Fraction(1, 1000) if kind == "pac" else None,
        "n": 6905,
        "discard": 0,
        "looks": 1,
        "law": LAW,
        "assumptions": ("IID", "TRANSLATION_INVARIANCE"),
        "evidence": {"network": "abc", "scale": (1.25).hex()},
        "intersample": (0.0, 0.125),
    }
    return error_claim(**(fields | changes))


def test_the_pac_sentence():
    text = claim().statement()
    for part in (
        "With confidence 0.999",
        "6,905",
        "probability at most 0.001",
        "no probabilistic statement",
        "IID",
    ):
        assert part in text
    assert "proved" not in text and "guarantee" not in text


def test_assumed_is_printed_as_assumed_and_promises_nothing():
    assumed = claim("assumed")
    assert assumed.statement().startswith("ASSUMED, not shown")
    assert "confidence" not in assumed.statement() and "probability" not in assumed.statement()
    for nu in (Uniform(0.5), Density(1.0), Point()):
        assert isinstance(assumed.risk(nu), NoStatement)


def test_risk_of_a_set_a_density_and_a_point():
    c = claim()
    assert c.risk(Uniform(0.25)).bound == Fraction(4, 1000)
    assert c.risk(Uniform(0.25)).unconditional == Fraction(5, 1000)
    assert c.risk(Uniform(0.25, shift=0.01)).bound == Fraction(14, 1000)
    assert c.risk(Density(3)).bound == Fraction(3, 1000)
    assert c.risk(Uniform(1e-9)).bound == 1
    assert isinstance(c.risk(Point()), NoStatement)
    for share in (0, -0.1, 1.1):
        with pytest.raises(InputError, match="share"):
            c.risk(Uniform(share))


def test_a_marginal_claim_does_not_survive_selection():
    assert isinstance(claim("conformal").risk(Uniform(0.5)), NoStatement)


def test_a_cover_speaks_of_every_run():
    assert claim("cover").risk(Point()).bound == 0
    assert "No run leaves the tube" in claim("cover").statement()


def test_per_bin_risk_uses_the_bin_and_its_share():
    c = claim(bin_eps=(Fraction(1, 100), None), evidence={"bin_share": ["3/10", "7/10"]})
    assert c.risk(Uniform(0.15, bin=0)).bound == Fraction(2, 100)
    assert c.risk(Uniform(0.15)).bound == Fraction(1, 100) / Fraction("0.15")
    assert isinstance(c.risk(Uniform(0.15, bin=1)), NoStatement)
    assert isinstance(c.risk(Density(2.0)), NoStatement)


def test_without_a_finite_tube_there_is_no_claim():
    none = claim(tube=tube(TUBE.edges, TUBE.interval * np.inf, TUBE.final), evidence={"failed": 3})
    assert none.statement().startswith("No claim: 3 of 6,905")
    assert isinstance(none.risk(Uniform(0.5)), NoStatement)
    half = claim(
        tube=tube(TUBE.edges, TUBE.interval * np.array([1, np.inf])[:, None, None], TUBE.final)
    )
    assert "1 of 2 bins of K have no claim" in half.statement()


@pytest.mark.parametrize("kind", ["pac", "conformal", "cover", "assumed", "declared"])
def test_json_keeps_every_number(kind, tmp_path):
    c = claim(kind)
    data = json.loads(json.dumps(c.to_json()))
    back = claim_from_json(data, tube_from_json(json.loads(json.dumps(tube_to_json(c.tube)))))
    assert back.to_json() == c.to_json() and back.tube.hash == c.tube.hash
    assert data["kind"] == kind and data["statement"] == c.statement() and data["n"] == 6905
    assert load_claim(c.save(tmp_path / "claim.json")).to_json() == c.to_json()


def test_json_holds_no_floats():
    def floats(value):
        if isinstance(value, dict):
            return any(floats(v) for v in value.values())
        if isinstance(value, list):
            return any(floats(v) for v in value)
        return isinstance(value, float)

    assert not floats(claim().to_json()) and not floats(tube_to_json(TUBE))


def test_damaged_claims_are_refused(tmp_path):
    path = claim().save(tmp_path / "claim.json")
    path.write_text(path.read_text()[:-40])
    with pytest.raises(InputError, match="complete claim file"):
        load_claim(path)
    data = claim().to_json()
    with pytest.raises(InputError, match="kind one of"):
        claim_from_json(data | {"kind": "estimate"}, TUBE)
    with pytest.raises(InputError, match="eps"):
        claim_from_json({name: v for name, v in data.items() if name != "eps"}, TUBE)


def test_a_claim_survives_a_wider_tube_only():
    wider = tube(TUBE.edges, TUBE.interval * 2, TUBE.final)
    assert weaker(claim(), wider, search="x").evidence["search"] == "x"
    with pytest.raises(InputError, match="narrower"):
        weaker(claim(), tube(TUBE.edges, TUBE.interval * 0.999, TUBE.final))


def test_laws_differ_when_anything_declared_differs():
    laws = [
        LAW,
        law_spec("toy", box([0, 0], [1, 1]), parameters={"wind": 0.6}),
        law_spec("toy", box([0, 0], [1, 2]), parameters={"wind": 0.5}),
        law_spec("toy", box([0, 0], [1, 1]), "given", {"wind": 0.5}),
    ]
    assert len({law.hash for law in laws}) == 4
    assert law_spec("toy", box([0, 0], [1, 1]), parameters={"wind": 0.5}).hash == LAW.hash


def test_a_claim_is_one_line():
    assert repr(claim()) == (
        "ErrorClaim(pac, eps 0.001, delta 0.001, 6,905 runs of toy, "
        "Tube(2 bins of K, 3 intervals, median half width 0.1 m))"
    )
    assert repr(claim("assumed")).startswith("ErrorClaim(assumed, 6,905 runs of toy, Tube(")


def test_a_share_of_K_is_promised_only_where_k_was_uniform():
    uniform = claim().statement()
    assert "uniformly at random from a certified set of share s of K: at most 0.001/s" in uniform
    domain = box([0, 0], [1, 1])
    for law, word in (("logged", "as in the log"), ("given", "were given"), ("pilot", "by pilot")):
        text = claim(law=law_spec("toy", domain, law)).statement()
        assert word in text and "of share s of K" not in text
        assert "The share of K that the set fills says nothing" in text


def test_a_tube_is_bound_to_its_claim():
    made = claim()
    narrower = tube(TUBE.edges, TUBE.interval * 1e-3, TUBE.final * 1e-3)
    assert made.evidence["tube"] == TUBE.hash
    with pytest.raises(InputError, match="made about"):
        check_tube(replace(made, tube=narrower))
    with pytest.raises(InputError, match="made about"):
        claim_from_json(made.to_json(), narrower)
    wider = tube(TUBE.edges, TUBE.interval * 2, TUBE.final)
    check_tube(weaker(made, wider))
    check_tube(on_bins(made, [[0, 0.1 + 0.2, 0.5, 1], [0, 1]]))


def test_a_claim_of_an_older_file_is_still_read():
    old = claim().to_json()
    del old["evidence"]["tube"]
    assert claim_from_json(old, TUBE).eps == claim().eps
