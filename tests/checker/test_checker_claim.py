"""The arithmetic of claims: against the binomial sum in fractions, and against what the engine
claims.
"""

import json
import random
from fractions import Fraction
from math import comb

import answer_files as build
import known
import pytest
from effort import calls_of

from parc_jax import checker
from parc_jax.checker.claim import ONE, checked_claim, share, told
from parc_jax.learning.bound.calibrate import pac_label
from parc_jax.learning.bound.counts import MOST, required_runs, wrong_claim_probability

pytestmark = pytest.mark.soundness

MILLI = Fraction(1, 1000)


def summed(n, discard, eps):
    """The tail, term by term."""
    return sum(comb(n, i) * eps**i * (1 - eps) ** (n - i) for i in range(discard + 1))


def asked(claim, n_bins=1):
    return checked_claim(claim | {"network_hash": "", "tube_hash": ""}, HASHES, n_bins)


HASHES = {"network": "", "tube": ""}
CLAIM = build.scene(0)["claim"]


def test_a_share_is_the_binomial_sum_rounded_up_by_next_to_nothing():
    rng = random.Random(0)
    for _ in range(200):
        n = rng.randint(1, 300)
        discard = rng.randint(0, min(n, rng.choice([0, 3, 300])))
        eps, delta = Fraction(rng.randint(1, 999), 1000), Fraction(1, rng.choice([2, 10**3, 10**9]))
        exact = summed(n, discard, eps) / delta
        told = Fraction(share(n, discard, eps, delta), ONE)
        assert exact <= told <= exact * (1 + Fraction(1, 2**90)) + Fraction(1, ONE)


def test_what_is_exactly_enough_is_enough():
    assert share(1, 0, Fraction(1, 2), Fraction(1, 2)) == ONE
    assert share(3, 0, Fraction(3, 4), Fraction(1, 64)) == ONE
    assert share(3, 3, Fraction(3, 4), Fraction(1, 64)) >= 64 * ONE
    assert share(3, 0, Fraction(1), MILLI) == 0  # that at most all runs leave needs none


@pytest.mark.parametrize(
    "n, discard, eps, delta",
    [
        (100_000, 9_700, Fraction(1, 10), MILLI),
        (10**9 - 1, 0, Fraction(1, 10**8), MILLI),
        (10**9 - 1, 50, 1 - Fraction(1, 10**900), Fraction(1, 10**900)),
    ],
)
def test_large_numbers_are_little_work(n, discard, eps, delta):
    assert calls_of(lambda: share(n, discard, eps, delta)) < 3 * discard + 500
    assert 0 < share(n, discard, eps, delta) < ONE * 2**3000


def test_what_the_engine_claims_is_right_and_one_run_less_is_not():
    rng = random.Random(1)
    for _ in range(60):
        n, eps = int(10 ** rng.uniform(1, 5)), Fraction(f"{10 ** rng.uniform(-4, -0.1):.3g}")
        delta = Fraction(f"{10 ** rng.uniform(-9, -0.1):.3g}") / rng.choice([1, 3, 64])
        least, discard = pac_label(n, eps, delta, rng.choice([0, MOST]))
        assert share(n, discard, least, delta) <= ONE
        needed = required_runs(float(eps), float(delta), 5)
        assert share(needed, 5, eps, delta) <= ONE < share(needed - 1, 5, eps, delta)


@pytest.mark.parametrize(
    "n, eps, discard", [(1_225_428, 1.57051e-05, 15), (1_853_218, 3.05834e-4, 459)]
)
def test_the_tail_of_a_million_runs_is_rounded_up(n, eps, discard):
    """Where scipy's is too small by several parts in 1e9."""
    bound = Fraction(wrong_claim_probability(n, eps, discard))
    assert share(n, discard, Fraction(eps), bound) <= ONE


def test_the_numbers_are_said():
    said = "6905 independent runs, 0 left outside, 1 looks, show eps = 1/1000 with delta = 1/1000"
    found = asked(CLAIM)
    assert found["checked"] and found["says"] == said
    checked = [[name, *rest] for name, *rest in found["premises"] if rest[0] == "checked"]
    assert checked == [[name, "checked", known.SHOWN[name]] for name in known.SHOWN]
    recorded = asked(CLAIM | {"evidence": {"rows": 9000}})
    assert "6905 independent recordings" in recorded["says"]
    few = {"n": 3000, "discard": 0, "eps": "1/100"}
    bins = {"bin_eps": ["1/100", None], "evidence": {"blocks": [few]}, "eps": "1/100"}
    many = asked(CLAIM | bins, 2)["says"]
    assert many.startswith("in 1 block with 1 of 2 bins 3000 independent runs or more")


@pytest.mark.parametrize("name", ["n", "discard", "looks", "eps", "delta", "bin_eps"])
def test_a_claim_without_its_numbers_is_assumed_and_says_so(name):
    answer = known.plain()
    del answer["claim"][name]
    build.rehash(answer)
    report = checker.check_answer(answer)
    assert not report.arithmetic["checked"] and report.arithmetic["says"] == f"it lacks {name}"
    assert all(standing != "checked" for _, standing, _ in report.arithmetic["premises"])
    text = " ".join(checker.summary(report))
    assert "the claim's arithmetic was not checked" in text and f"it lacks {name}" in text


def test_an_older_claim_about_bins_is_not_checked():
    bins = CLAIM | {"bin_eps": ["1/1000"], "evidence": {"bin_runs": [9]}}
    assert asked(bins)["checked"] is False
    assert "lacks the runs of each block" in " ".join(told(bins, asked(bins), {}))


def test_blocks_share_delta_as_they_need_it():
    """Ten blocks of a thousandth each fit into a hundredth, which is less than a share for all."""
    for blocks in ([known.BLOCK] * 9, [known.BLOCK] * 9 + [known.BLOCK | {"n": 10**6}]):
        answer = build.rehash(known.claim_of_bins(*blocks))
        assert checker.check_answer(json.loads(json.dumps(answer))).arithmetic["checked"]


@pytest.mark.parametrize("kind", ["assumed", "declared", "conformal", "cover"])
def test_other_kinds_have_no_numbers(kind):
    claim = CLAIM | {"kind": kind, "n": "many"}
    assert not asked(claim)["checked"] and "ASSUMED" in " ".join(told(claim, asked(claim), {}))
