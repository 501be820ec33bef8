"""Uncertainty in the shell: options on top of the scene's own table; what does not fit is one
sentence and exit code 2.
"""

import pytest
import toy_query

from parc_jax.app.cli.scene import under_uncertainty
from parc_jax.problem.uncertainty import Uncertainty


@pytest.fixture
def shell(shell, files):
    """`solve` on the toy query with these options."""
    return lambda *options: shell("solve", "model.npz", "scene.toml", "--no-cache", *options)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (
            ("--uncertainty-start", 0.5),
            "expected less uncertainty of start and goal than the goal is wide",
        ),
        (
            ("--uncertainty-k", "speed=0.1"),
            "expected parameters of the model (k0, k1), each once; got 'speed'",
        ),
        (
            ("--uncertainty-k", "k0=0.5", "k0=0.001"),
            "uncertainty k: expected every parameter once; k0",
        ),
        (
            ("--uncertainty-k", "k0=0.5", "0=0.001"),
            "(k0, k1), each once; got 'k0' and 0",
        ),
        (("--given", "k0=0.5", "--given", "k1=0.5"), "--given: expected every option once"),
        (
            ("--uncertainty-k=k0=0.5", "--uncertainty-k", "k0=0.1"),
            "--uncertainty-k: expected every option once",
        ),
        (("--given", "k0=0.9", "--uncertainty-k", "k0=0.5"), "got [0.9, 0.9] (measured, executed"),
        (("--uncertainty-k", "k0"), "--uncertainty-k: expected NAME=VALUE or NAME=LO:HI"),
        (("--unknown", "k0=0.1"), "uncertainty unknown of k0: expected a box (lo, hi)"),
        (
            ("--given", "k0=1.5"),
            "uncertainty of k0: expected a box within K, [-1, 1]; got [1.5, 1.5]",
        ),
        (("--given", "k0=0", "k1=0"), "expected at least one parameter to choose"),
    ],
)
def test_bad_uncertainty_is_one_sentence(shell, options, sentence):
    code, _, complained = shell(*options)
    assert code == 2 and sentence in complained and complained.count("\n") == 1


def test_an_answer_under_uncertainty(shell, tmp_path):
    stale = tmp_path / "of.validated.json"  # of an earlier answer of that name
    stale.touch()
    options = ("--uncertainty-start", 0.02, 0.01, "--sensing-eps", "0.001", "--target", 0.3)
    code, said, _ = shell(*options, "--budget", 2, "--out", stale.with_name("of.json"))
    assert not stale.exists()
    assert code == 0 and "every start within ±0.02, ±0.01 m" in said
    assert "lies outside of its uncertainty with probability at most 0.001" in said


def test_options_replace_entries_of_the_scene():
    own = toy_query.gap().replace(uncertainty=Uncertainty(start=0.1, goal=0.2, k={"k0": 0.3}))
    asked = under_uncertainty(own, {"goal": (0.4,), "unknown": ("1=0:1",), "k": ("k0=0.5",)})
    assert asked.uncertainty.start == (0.1,) and asked.uncertainty.goal == (0.4,)
    assert asked.uncertainty.k == (("k0", 0.5),) and asked.uncertainty.unknown == ((1, (0.0, 1.0)),)
    assert under_uncertainty(own, {}) is own
