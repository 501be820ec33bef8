"""The attacks measure what they say: exact truths, counted promises, a table of faults that fits
the code.
"""

import importlib
import json
from dataclasses import replace

import jax
import numpy as np
import pytest
from profiles import training_profile
from toy_models import assumed

from benchmarks.attacks import mutations
from benchmarks.attacks.__main__ import main, names
from benchmarks.attacks.coverage import interval, refuted, repeat
from benchmarks.attacks.fault import ROOT, Fault
from benchmarks.attacks.faults import FAULTS, misfits
from benchmarks.attacks.jump_plant import (
    jump_plant,
    network,
    recordings,
    truth,
    truth_of_recordings,
)
from benchmarks.attacks.promises import PROMISES, Promise
from parc_jax.common.keys import Stage
from parc_jax.learning.bound.error_set import faces
from parc_jax.learning.bound.monitor import inside_tube
from parc_jax.learning.bound.pipeline import learn_profile
from parc_jax.learning.bound.tube import fitted_tube
from parc_jax.learning.runs.collect import collect

KEY = jax.random.PRNGKey(3)


@pytest.mark.slow
@pytest.mark.parametrize("bins", [(4, 1), (2, 3)])
@pytest.mark.parametrize("shape", ["box", "fitted"])
def test_the_exact_truth_is_what_runs_do(bins, shape):
    system, net = jump_plant(0.05), network()
    seen = collect(system, KEY, 60, quiet=True)
    tube = learn_profile(net, seen, (), bins, shape=shape)
    if shape == "fitted":  # off centre, so that it is left on both sides
        during, at_end = tube.templates
        moved = faces(at_end.directions, at_end.centre + 0.1, at_end.half, frames=True)
        tube = fitted_tube(tube.edges, during, moved)
    runs = collect(system, KEY, 20_000, Stage.VALIDATE, chunk=2048, quiet=True)
    known = truth(0.05, tube)
    left = ~inside_tube(assumed(net, tube, runs.time, runs.name), net, runs)
    assert left.mean() == pytest.approx(known.whole, abs=4 * np.sqrt(known.whole / runs.n))
    numbers = tube.bin_of(runs.k)
    for number in range(tube.n_bins):
        here = left[numbers == number]
        assert here.mean() == pytest.approx(known.by_bin[number], abs=4 * np.sqrt(0.25 / len(here)))
    assert known.share.sum() == pytest.approx(1.0)


def test_the_exact_truth_of_recordings_is_what_they_do():
    net, rng = network(), np.random.default_rng(5)
    tube = training_profile(net, recordings(0.05, rng, 30, 4), (2, 1))
    known = truth_of_recordings(0.05, tube, 4)
    runs = recordings(0.05, rng, 5000, 4)
    left = ~inside_tube(assumed(net, tube, runs.time), net, runs).reshape(5000, 4).all(axis=1)
    assert left.mean() == pytest.approx(known, abs=4 * np.sqrt(known / 5000))


def test_the_interval_of_a_frequency():
    assert interval(0, 10, 0.1) == (0.0, pytest.approx(1 - 0.05**0.1))
    assert interval(10, 10, 0.1) == (pytest.approx(0.05**0.1), 1.0)


@pytest.mark.night
@pytest.mark.parametrize("promise", PROMISES, ids=lambda promise: promise.name)
def test_every_promise_can_be_repeated(promise):
    row = repeat(promise, 0.02, 2, 0)
    assert row["repeats"] == 2 and row["allowed"] > 0


def test_a_promise_broken_too_often_is_refuted():
    always = Promise("always", lambda width, key: (0.1, 0.2))
    never = Promise("never", lambda width, key: (0.1, 0.1))
    assert refuted(repeat(always, 0.0, 20, 0)) and not refuted(repeat(never, 0.0, 20, 0))


def test_an_unknown_attack_is_refused(capsys):
    assert "coverage" in names() and main(["nothing"]) == 2
    assert "expected one of" in capsys.readouterr().err


def test_every_fault_fits_the_code():
    """The text that a fault replaces stands in the code exactly once, and its test exists. Who has
    moved the code moves the fault along: benchmarks/attacks/faults_*.py.
    """
    assert not misfits(), "\n".join(misfits())
    assert len(FAULTS) >= 60


def test_changes_that_survive_are_listed_and_those_left_out_are_not_counted():
    places = {"start_pos": [7, 1], "definition_name": "f", "operator_name": "core/AddNot"}
    results = [("normal", "killed"), ("normal", "survived"), ("skipped", None), None]
    dump = "\n".join(
        json.dumps(
            [
                {"mutations": [places]},
                one and {"worker_outcome": one[0], "test_outcome": one[1]},
            ]
        )
        for one in results
    )
    assert mutations.survivors(dump) == (["line 7 of f: core/AddNot"], 2)
    for file, guard in mutations.CORE.items():
        assert guard.tests and all((ROOT / name).exists() for name in (file, *guard.tests))


def test_a_fault_that_no_longer_fits_is_told(tmp_path):
    (tmp_path / "code.txt").write_text("a = 1\nb = 1\n")
    (tmp_path / "test_code.py").write_text("def test_a():\n    pass\n")
    fits = Fault("a", "./code.txt", "a = 1", "a = 2", "test_code.py::test_a")
    assert fits.missing(tmp_path) is None
    assert fits.planted(tmp_path)[1:] == ("a = 1\nb = 1\n", "a = 2\nb = 1\n")
    for other, why in (
        (replace(fits, old="b = 2"), "0 times"),
        (replace(fits, place="./none.txt"), "does not exist"),
        (replace(fits, place="nowhere"), "name of 0 places"),
        (replace(fits, old="b = 1", test="test_code.py::test_b"), "no test"),
    ):
        assert why in other.missing(tmp_path)
    (tmp_path / "code.txt").write_text("a = 1\n" * 2)
    assert "2 times" in fits.missing(tmp_path)


def test_a_place_is_named_by_what_it_means_wherever_it_stands(tmp_path):
    """The same line in two functions, and the same function in two files."""
    text = "X = 1\n\n\n@wrapped\ndef one():\n    return 1\n\n\ndef two():\n    return 1\n"
    for name in ("first", "second"):
        (tmp_path / "parc_jax" / name).mkdir(parents=True)
        (tmp_path / "parc_jax" / name / "code.py").write_text(text.replace("two", f"two_{name}"))
    where = {
        "two_first": ("first", 1),
        "first.code.one": ("first", 0),
        "second.code.one": ("second", 0),
    }
    for place, (folder, which) in where.items():
        path, good, bad = Fault("a", place, "return 1", "return 2", "").planted(tmp_path)
        assert path == tmp_path / "parc_jax" / folder / "code.py"
        parts = good.split("return 1")
        both = ("return 2", "return 1") if which == 0 else ("return 1", "return 2")
        assert bad == parts[0] + both[0] + parts[1] + both[1] + parts[2]
    both = Fault("a", "code.one", "return 1", "return 2", "")
    assert "name of 2 places" in both.missing(tmp_path)


@pytest.mark.parametrize("name", ["mutants", "borders"])
def test_a_campaign_against_the_checker_continues_where_it_was(name, tmp_path, monkeypatch, capsys):
    """The second call finds enough in the file and only prints the table."""
    campaign = importlib.import_module(f"benchmarks.attacks.{name}")
    monkeypatch.setattr(campaign, "FIRST_SEED", 1001)
    monkeypatch.setattr(campaign, "PER_SCENE" if name == "mutants" else "RAYS", 8)
    arguments = ["--n", "8", "--path", str(tmp_path / "kept" / "counts.jsonl")]
    assert campaign.main(arguments) == 0
    table = capsys.readouterr().out
    assert "|---|" in table
    kept = (tmp_path / "kept" / "counts.jsonl").read_text()
    assert len(kept.splitlines()) == 1
    assert campaign.main(arguments) == 0
    assert capsys.readouterr().out == table
    assert (tmp_path / "kept" / "counts.jsonl").read_text() == kept


def test_a_campaign_that_finds_something_says_so(tmp_path, capsys):
    from benchmarks.attacks import borders, mutants

    path = tmp_path / "counts.jsonl"
    path.write_text(json.dumps({"seed": 1, "counts": [["k", "false", 3], ["k", "rejected", 9]]}))
    assert mutants.main(["--n", "1", "--path", str(path)]) == 1
    assert "| k | 9 | 0 | 3 |" in capsys.readouterr().out
    counts = [[["polytope", "on", "in"], 5], ["wrong: accepted, but not safe", 2]]
    path.write_text(json.dumps({"seed": 1, "counts": counts}))
    assert borders.main(["--n", "1", "--path", str(path)]) == 1
    assert "wrong: accepted, but not safe: 2" in capsys.readouterr().out
