"""The sentences of an answer promise no more than their numbers."""

from fractions import Fraction

import pytest

from parc_jax.claim.risk import NoStatement
from parc_jax.sentences import about_plans, about_risk, rounded_up


@pytest.mark.parametrize(
    ("value", "text"),
    [(Fraction(1, 3), "0.34"), (0.25, "0.25"), (0.1, "0.11"), (Fraction(1, 10), "0.1"), (1.0, "1")],
)
def test_a_bound_is_never_rounded_down(value, text):
    """The float 0.1 is a little more than a tenth."""
    assert rounded_up(value) == text and Fraction(text) >= Fraction(value)


def test_only_what_the_checker_accepted_is_called_proved():
    assert about_plans(3, 2, 1, proved=True).endswith("proved in exact arithmetic.")
    assert "proved" not in about_plans(3, 2, 1, proved=False)


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
    said = about_plans(*counts, proved=True)
    assert text in said and " 0 " not in said and " 1 " not in said


def test_without_a_bound_there_is_a_reason():
    assert (
        about_risk(NoStatement("of this"), "a set", 1.0, 0.99, None)
        == "Risk: no statement, since of this."
    )
