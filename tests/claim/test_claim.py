"""What a claim says, what it refuses to say, and how it travels."""

import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from claim_files import load_claim, save_claim

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.learning.bound.claim import check_claim, derived, error_claim, weaker
from parc_jax.learning.bound.claim_file import claim_from_json
from parc_jax.learning.bound.counts import NoStatement
from parc_jax.learning.bound.tube import tube, tube_from_json, tube_to_json
from parc_jax.learning.runs.law import law_spec, subject, told_of_part
from parc_jax.learning.system import STAYS, TURNS, time_grid

pytestmark = pytest.mark.soundness
K = box([0, 0], [1, 1])
LAW = law_spec("toy", K, parameters={"wind": 0.5})
TUBE = tube([[0, 0.1 + 0.2, 1], [0, 1]], np.full((2, 3, 2), 0.1), np.full((2, 3), 1 / 3))


def claim(kind="pac", **changes):
    law = changes.get("law", LAW)
    fields = {
        "kind": kind,
        "tube": TUBE,
        "subject": subject("toy", K, time_grid(0.5, 1.5), 2, 1),
        "network": "abc",
        "quantifier": f"a new rollout drawn from {law.describe()}",
        "eps": None if kind == "assumed" else Fraction(1, 1000),
        "delta": Fraction(1, 1000) if kind == "pac" else None,
        "n": 6905,
        "discard": 0,
        "looks": 1,
        "law": LAW,
        "assumptions": ("IID", "TRANSLATION_INVARIANCE"),
        "evidence": {"scale": (1.25).hex()},
        "intersample": (0.0, 0.125),
    }
    return error_claim(**(fields | changes))


def test_the_pac_sentence():
    text = claim().details()
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
    assert assumed.details().startswith("ASSUMED, not shown")
    assert "confidence" not in assumed.details() and "probability" not in assumed.details()
    for law in ({"share": 0.5}, {"density": 1.0}, {}):
        assert isinstance(assumed.risk(**law), NoStatement)


def test_risk_of_a_set_a_density_and_a_point():
    c = claim()
    assert c.risk(share=0.25).bound == Fraction(4, 1000)
    assert c.risk(share=0.25).unconditional == Fraction(5, 1000)
    assert c.risk(share=0.25, shift=0.01).bound == Fraction(14, 1000)
    assert c.risk(density=3).bound == Fraction(3, 1000)
    assert c.risk(share=1e-9).bound == 1
    assert isinstance(c.risk(), NoStatement)
    assert c.risk(density="3", shift="0.01").bound == Fraction(13, 1000)
    for share in (0, -0.1, 1.1, np.nan, True, "1/0"):
        with pytest.raises(InputError, match="share"):
            c.risk(share=share)
    for density in (0.99, 0, -1, np.nan, np.inf):
        with pytest.raises(InputError, match="density"):
            c.risk(density=density)
    for bin in (-1, 2, 7, True, 1.0):
        with pytest.raises(InputError, match="bin: expected one of 2, from 0 on"):
            c.risk(share=0.5, bin=bin)
    for both in ({"share": 0.5, "density": 2}, {"density": 2, "bin": 0}, {"bin": 0}):
        with pytest.raises(InputError, match="expected share, with or without bin, or density"):
            c.risk(**both)


def test_per_bin_risk_uses_the_bin_and_its_share():
    c = claim(bin_eps=(Fraction(1, 100), None), evidence={"bin_share": ["3/10", "7/10"]})
    assert c.risk(share=0.15, bin=0).bound == Fraction(2, 100)
    assert c.risk(share=0.15).bound == Fraction(1, 100) / Fraction("0.15")
    assert isinstance(c.risk(share=0.15, bin=1), NoStatement)
    assert isinstance(c.risk(density=2.0), NoStatement)
    assert c.risk(density=2.0, claimed=True).bound == Fraction(2, 100)
    none = claim(bin_eps=(None, None), evidence={"bin_share": ["3/10", "7/10"]})
    assert isinstance(none.risk(density=2.0, claimed=True), NoStatement)


def test_a_share_in_decimals_of_a_bin_is_the_smaller_one():
    """Of 0.2 of K, whose edges are floats: "expected a share in (0, 0.2]; got 1/5"."""
    whole = Fraction(1, 5) - Fraction(1, 10**18)
    c = claim(bin_eps=(Fraction(1, 100), None), evidence={"bin_share": [str(whole), "4/5"]})
    assert c.risk(share=0.2, bin=0).bound == Fraction(1, 100)
    assert c.risk(share=0.1, bin=0).bound == Fraction(1, 10) * whole
    for share in (0.2 * (1 + 1e-8), 0.5, 1.5):
        with pytest.raises(InputError, match=r"a share up to 0\.2, of bin 0; got"):
            c.risk(share=share, bin=0)
    with pytest.raises(InputError, match="share"):
        c.risk(share=0, bin=0)


def test_without_a_finite_tube_there_is_no_claim():
    none = claim(tube=tube(TUBE.edges, TUBE.interval * np.inf, TUBE.final), evidence={"failed": 3})
    assert none.details().startswith("No claim: 3 of 6,905")
    assert isinstance(none.risk(share=0.5), NoStatement)
    half = claim(
        tube=tube(TUBE.edges, TUBE.interval * np.array([1, np.inf])[:, None, None], TUBE.final)
    )
    assert "1 of 2 bins of K have no claim" in half.details()


@pytest.mark.parametrize("kind", ["pac", "assumed", "declared"])
def test_json_keeps_every_number(kind, tmp_path):
    c = claim(kind)
    data = json.loads(json.dumps(c.to_json()))
    back = claim_from_json(data, tube_from_json(json.loads(json.dumps(tube_to_json(c.tube)))))
    assert back.to_json() == c.to_json() and back.tube.hash == c.tube.hash
    assert data["kind"] == kind and data["statement"] == c.details() and data["n"] == 6905
    assert load_claim(save_claim(c, tmp_path / "claim.json")).to_json() == c.to_json()


def test_json_holds_no_floats():
    def floats(value):
        if isinstance(value, dict):
            return any(floats(v) for v in value.values())
        if isinstance(value, list):
            return any(floats(v) for v in value)
        return isinstance(value, float)

    assert not floats(claim().to_json()) and not floats(tube_to_json(TUBE))


def test_damaged_claims_are_refused():
    data = claim().to_json()
    with pytest.raises(InputError, match="kind one of"):
        claim_from_json(data | {"kind": "estimate"}, TUBE)
    with pytest.raises(InputError, match="eps"):
        claim_from_json({name: v for name, v in data.items() if name != "eps"}, TUBE)


def test_a_claim_survives_a_wider_tube_only():
    wider = tube(TUBE.edges, TUBE.interval * 2, TUBE.final)
    assert weaker(claim(), wider, why="x").evidence["why"] == "x"
    with pytest.raises(InputError, match="narrower"):
        weaker(claim(), tube(TUBE.edges, TUBE.interval * 0.999, TUBE.final))


def test_a_wider_tube_is_of_the_same_bins_and_points():
    """An inner edge moved from 0.75 to 0.99 gave the wide bin's k the narrow bin's tube."""
    edges, wide = [[0, 0.5, 1], [0, 1]], (np.ones((2, 4, 2)), np.ones((2, 2)))
    two = tube(edges, *wide)
    others = tube([[0, 0.9, 1], [0, 1]], *wide), tube([[0, 0.5, 1]], *wide), tube(edges, *wide, 2)
    assert two.at_least(two) and not any(other.at_least(two) for other in others)


def test_laws_differ_when_anything_declared_differs():
    laws = [
        LAW,
        law_spec("toy", box([0, 0], [1, 1]), parameters={"wind": 0.6}),
        law_spec("toy", box([0, 0], [1, 2]), parameters={"wind": 0.5}),
        law_spec("toy", box([0, 0], [1, 1]), "given", {"wind": 0.5}),
    ]
    assert len({law.hash for law in laws}) == 4
    assert law_spec("toy", box([0, 0], [1, 1]), parameters={"wind": 0.5}).hash == LAW.hash


def test_a_share_of_K_is_promised_only_where_k_was_uniform():
    uniform = claim().details()
    assert "uniformly at random from a certified set of share s of K: at most 0.001/s" in uniform
    domain = box([0, 0], [1, 1])
    for law, word in (
        ("logged", "as in the log"),
        ("given (1, 2)", "as given (1, 2)"),
        ("p", "by p"),
    ):
        text = claim(law=law_spec("toy", domain, law)).details()
        assert word in text and "of share s of K" not in text
        assert "which need not be the set's share of K: at most 0.001/s" in text


def test_a_share_of_recordings_is_one_of_a_run_of_each():
    """One recording of many may have most runs, and all runs that fail."""
    alone = "s and risk are those of one run, drawn from a new recording; of all runs together"
    for law in (LAW, law_spec("toy", K, "logged")):
        assert alone not in claim(law=law).details()
        about = f"any run of a new recording drawn from {law.describe()}"
        evidence = {"scale": (1.25).hex(), "rows": 9000}
        of_recordings = claim(law=law, quantifier=about, evidence=evidence)
        assert (
            alone in of_recordings.details()
            and "6,905 calibration recordings (of 9,000 runs)" in of_recordings.details()
        )


NARROWER = tube(TUBE.edges, TUBE.interval * 1e-3, TUBE.final * 1e-3)
LARGER = tube([[0, 0.1 + 0.2, 2], [0, 1]], TUBE.interval, TUBE.final)


def of(**about):
    return {"subject": replace(claim().subject, **about)}


def by(law):
    """What a claim says of a law."""
    return {"law": law, "quantifier": f"a new rollout drawn from {law.describe()}"}


WIDER = of(domain=box([0, 0], [2, 1])) | {"tube": LARGER}
FROM_ELSEWHERE = {
    "tube": {"tube": NARROWER},
    "network": {"network": "abd"},
    "law": by(law_spec("toy", K, parameters={"wind": 0.6})),
    "system": of(system="another"),
    "K": WIDER | by(law_spec("toy", box([0, 0], [2, 1]), parameters={"wind": 0.5})),
    "time grid": of(time=time_grid(0.25, 0.75)),
    "records": of(time=time_grid(0.5, 1.5, 0.1)),
    "points": of(points=("nose",)),
    "rotation": of(rotation=(TURNS,)) | {"assumptions": ("IID", "ROTATION_INVARIANCE")},
}


@pytest.mark.parametrize("part", FROM_ELSEWHERE)
def test_every_part_is_bound_to_its_claim(part, tmp_path):
    """In memory and from a file: what a claim says of one thing is no claim about another."""
    other = replace(claim(), **FROM_ELSEWHERE[part])
    with pytest.raises(InputError, match="made about"):
        check_claim(other)
    with pytest.raises(InputError, match="made about"):
        claim_from_json(other.facts() | {"statement": "", "hash": other.hash}, other.tube)
    for say in (
        other.details,
        lambda: other.risk(share=0.5),
        lambda: save_claim(other, tmp_path / "c"),
    ):
        with pytest.raises(InputError, match="made about"):
            say()


def test_the_order_of_points_and_every_word_of_rotation_count():
    two = subject("toy", K, time_grid(0.5, 1.5), 1, 2, ("nose", "tail"))
    widths = tube(TUBE.edges, TUBE.interval, np.ones((2, 4)), n_points=2)
    made = claim(subject=two, tube=widths)
    with pytest.raises(InputError, match="made about"):
        check_claim(replace(made, subject=replace(two, points=("tail", "nose"))))
    turns = claim(subject=subject("toy", K, time_grid(0.5, 1.5), 2, 1, rotation=(TURNS,)))
    with pytest.raises(InputError, match="made about"):
        check_claim(replace(turns, subject=replace(turns.subject, rotation=(STAYS,))))


def test_a_law_is_told_with_its_box_to_the_last_digit():
    law = told_of_part(law_spec("toy", box([0.1], [1 / 3])))
    assert law.k_law == "a uniform draw on [0.1, 0.3333333333333333], of which K is a part"


def test_labels_are_for_people():
    made = claim()
    named = made.subject.with_labels({"k": ("speed [m/s]", "turn [rad]")})
    assert derived(made, subject=named).hash == made.hash


def test_a_claim_told_of_something_else_is_bound_to_that():
    wider = tube(TUBE.edges, TUBE.interval * 2, TUBE.final)
    for told in (
        weaker(claim(), wider),
        derived(claim(), network="of a copy"),
    ):
        check_claim(told)
        assert told.hash != claim().hash


@pytest.mark.parametrize(
    ("words", "changes"),
    [
        ("bins that span K = .0, 1. x .0, 1.; along axis 0 they cover .0, 2.", {"tube": LARGER}),
        ("K = .0, 2. x .0, 1. to be that of the law", WIDER),
        ("2 intervals, got 3", of(time=time_grid(0.5, 1.0))),
        ("2 reference points, got 1", of(points=("nose", "tail"))),
        (
            "3 axes of the workspace, got 2; 0 goal states, got 1",
            {"subject": subject("toy", K, time_grid(0.5, 1.5), 3, 0)},
        ),
    ],
)
def test_parts_that_do_not_fit_make_no_claim(words, changes):
    with pytest.raises(InputError, match=words) as caught:
        claim(**changes)
    assert "\n" not in str(caught.value)


def test_a_claim_of_an_older_file_is_refused():
    with pytest.raises(InputError, match=r"format parc_jax\.claim/3"):
        claim_from_json(claim().to_json() | {"format": "parc_jax.claim/1"}, TUBE)
