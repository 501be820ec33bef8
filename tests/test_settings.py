"""The record of a query's choices: presets, changes, and values without meaning."""

from decimal import Decimal
from fractions import Fraction

import jax.numpy as jnp
import numpy as np
import pytest

import parc_jax as pj
from benchmarks.neuralparc import Published


def test_the_default_is_the_whole_set_and_presets_differ_in_effort_alone():
    fast, whole = pj.Settings.fast(), pj.Settings.whole()
    assert pj.Settings() == whole
    assert fast.work < whole.work
    assert fast.samples_only and not whole.samples_only
    assert not fast.proof and whole.proof
    assert {s.method for s in (fast, whole)} == {None}  # the exact engine


def test_replace_changes_only_what_it_names():
    changed = pj.Settings().replace(samples=7, method=Published(lps=True))
    assert changed.samples == 7 and changed.method.lps
    assert changed.replace(samples=100, method=None) == pj.Settings()
    with pytest.raises(pj.InputError, match=r"expected fields among samples, .* got 'runs'"):
        pj.Settings().replace(runs=3)


@pytest.mark.parametrize(
    "changes",
    [
        {"target": 0.0},
        {"target": 1.0},
        {"confidence": 1.0},
        {"confidence": float("nan")},
        {"samples": 0},
        {"samples": 1.5},
        {"samples": True},
        {"samples": float("nan")},
        {"samples": float("inf")},
        {"budget_s": 0.0},
        {"budget_s": float("nan")},
        {"work": 0.0},
        {"work": float("nan")},
        {"work": float("inf")},
        {"method": "paper"},
    ],
    ids=str,
)
def test_values_without_meaning_are_refused_in_a_sentence(changes):
    with pytest.raises(pj.InputError, match=r"^settings: (samples: )?expected .*; got .*\."):
        pj.Settings(**changes)


@pytest.mark.parametrize("kind", [float, np.float32, np.asarray, jnp.asarray, Fraction, Decimal])
def test_a_number_may_be_of_any_kind(kind):
    asked = {
        "target": kind(0.25),
        "confidence": kind(0.5),
        "work": kind(2.0),
        "budget_s": kind(9.0),
    }
    assert all(getattr(pj.Settings(**asked), name) == value for name, value in asked.items())
