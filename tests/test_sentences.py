"""The sentences of an answer promise no more than their numbers."""

import ast
import itertools
import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import toy_driven

from parc_jax.answer.looks import Look
from parc_jax.common.premises import CHECKED, premises
from parc_jax.common.spelling import rounded_down, rounded_up
from parc_jax.drive.local.choice import FreshRuns
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.bound.counts import (
    NoStatement,
    Risk,
    clopper_pearson,
)
from parc_jax.learning.bound.start_gap import StartTrial, invariances
from parc_jax.learning.bound.statement import in_short
from parc_jax.proof.absence.prove_no_plan import UNDECIDED, NoPlan
from parc_jax.safe_set.corridors.stopping import Coverage
from parc_jax.statement import about_coverage, about_plans, about_risk, about_sensing

ROOT = Path(__file__).parents[1]
BOUND = re.compile(
    r"(?<![a-z])eps|delta|risk|bound|at_most|at_least|confidence|promise|unsafe|undecided"
)
DELTA = Fraction(1, 3000)  # 1 - delta has no end in decimals


@pytest.mark.parametrize(
    ("value", "text"),
    [(Fraction(1, 3), "0.34"), (0.25, "0.25"), (0.1, "0.11"), (Fraction(1, 10), "0.1"), (1.0, "1")],
)
def test_a_bound_is_never_rounded_down(value, text):
    """The float 0.1 is a little more than a tenth."""
    assert rounded_up(value) == text and Fraction(text) >= Fraction(value)


@pytest.mark.parametrize("digits", [1, 2, 4, 10])
def test_rounding_is_to_its_side_and_no_further(digits, rng):
    values = [Fraction(x) for x in rng.uniform(size=200) ** 8]
    values += [Fraction(12, 100) + Fraction(1, 10**40), Fraction(1, 3), Fraction(0), Fraction(7)]
    for value in values:
        below, above = (Fraction(f(value, digits)) for f in (rounded_down, rounded_up))
        assert below <= value <= above and above - below <= value * Fraction(10, 10**digits)
    assert rounded_up("0.1") == rounded_down("0.1") == "0.1" and rounded_up(np.inf) == "inf"


def numbers(said: str) -> list[Fraction]:
    """Percents and decimals of a sentence, in order; whole numbers are counts."""
    return [Fraction(x) for x in re.findall(r"\d+(?= %)|\d+\.\d+(?:e-\d+)?|\d+e-\d+", said)]


def sentences_of(n: int):
    """What is said where n runs, or n of 400, are behind it: sentence, exact bounds that it may not
    undercut, exact confidences and shares that it may not exceed, in the order of its numbers.
    """
    eps, sure = clopper_pearson(0, n, float(DELTA)), 1 - DELTA
    share = Fraction(n, 403)
    look = Look(1, 1, DELTA)
    yield FreshRuns(n, 0, eps, look, ("IID",), "toy").details(), [sure, eps], "du"
    p = premises([("delta", CHECKED, str(DELTA))])
    risk = about_risk(Risk(eps, eps), "a set", float(1 + eps), 0.99, p)
    yield risk, [eps, 1 + eps, Fraction("0.999"), Fraction("0.99"), sure], "uuddd"
    yield about_sensing(Risk(eps, eps), DELTA), [DELTA, eps + DELTA], "uu"
    covered = about_coverage(Coverage(1.0, float(share), 0.99, n, 0)).split("at least")[1]
    yield covered, [100 * Fraction(float(share)), Fraction("0.99")], "dd"
    none = NoPlan(UNDECIDED, 1 - share / 3, share / 3, Fraction(1))
    yield none.details().replace("p0", ""), [100 * share / 3], "u"
    trial = StartTrial(float(share), float(share) / 3)
    seen = [Fraction(str(trial.declared)), Fraction(trial.seen)]
    yield trial.said_in(invariances(None))[0], seen, "uu"


def test_no_sentence_undercuts_its_bound():
    for said, exact, ways in itertools.chain.from_iterable(map(sentences_of, range(8, 400, 7))):
        printed = numbers(said)
        exact = [(x, way) for x, way in zip(exact, ways, strict=True)]
        assert len(printed) == len(exact), said
        for shown, (value, way) in zip(printed, exact, strict=True):
            assert shown >= value if way == "u" else shown <= value, said


def test_no_claim_undercuts_its_bound():
    claim = toy_driven.model().claim
    for n in range(8, 400, 7):
        eps = clopper_pearson(0, n, float(DELTA))
        told = derived(claim, eps=eps, delta=DELTA)
        for said in (told.details().split(". For k")[0], in_short(told)):
            shown = sorted(x for x in numbers(said) if x < 1)
            assert any(eps <= x < eps * (1 + Fraction(1, 10**8)) for x in shown), said
            assert any(1 - DELTA - Fraction(1, 10**9) < x <= 1 - DELTA for x in shown), said


def test_the_line_of_an_answer_is_at_most_what_is_covered():
    answer = toy_driven.answer()
    for n in range(50):
        least = n / 50.3
        kept = answer.coverage._replace(at_least=least)
        answer = replace(answer, cover=answer.cover._replace(coverage=kept))
        shown = re.search(r"at least (\S+) %", repr(answer))[1]
        assert Fraction(shown) <= 100 * Fraction(least)


def formatted(text: str):
    """(expression, format) of every number in an f-string that is formatted to the nearest."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FormattedValue) and node.format_spec is not None:
            form = ast.unparse(node.format_spec)
            if re.search(r"[gef%]'$", form):
                yield ast.unparse(node.value), form


def test_no_bound_is_printed_to_the_nearest():
    """Bounds go through `rounded_up` and `rounded_down`: this looks at every f-string there is."""
    found = []
    for folder in ("parc_jax", "sims"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            file = str(path.relative_to(ROOT))
            printed = [x for x, _ in formatted(path.read_text()) if BOUND.search(x)]
            found += [(file, x) for x in printed]
    assert found == []
    assert list(formatted('f"{float(c.eps):.3g} {n:,} {eps}"')) == [("float(c.eps)", "f'.3g'")]


def test_only_what_the_checker_accepted_is_called_proved():
    assert about_plans(3, 2, 1, 1.5, proved=True).endswith("proved in exact arithmetic.")
    assert "proved" not in about_plans(3, 2, 1, 1.5, proved=False)


@pytest.mark.parametrize(
    ("counts", "text"),
    [
        ((1, 0, 0), "For the sample, and for every trajectory"),
        ((0, 0, 1), "For every (p0, k) that meets all conditions of the corridor, and for"),
        ((2, 0, 1234), "samples and every (p0, k) that meets all conditions of one of the 1,234 c"),
        ((3, 1, 2), "samples, every (p0, k) in the safe polytope and every (p0, k) that meets"),
    ],
)
def test_a_sentence_names_what_is_there_and_counts_in_english(counts, text):
    said = about_plans(*counts, 1.5, proved=True)
    assert "nothing is touched in its 1.5 s, and nothing is said of later; proved" in said
    assert text in said and " 0 " not in said and " 1 " not in said


def test_without_a_bound_there_is_a_reason():
    assert (
        about_risk(NoStatement("of this"), "a set", 1.0, 0.99, None)
        == "Risk: no statement, since of this."
    )
