"""The study of few runs: what it refuses, and a small laboratory from end to end."""

import json
import sys
from fractions import Fraction
from types import SimpleNamespace

import jax
import numpy as np
import pytest

from parc_jax.app.cli import main
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.common.status import Status
from parc_jax.learning.bound.measure import measure
from parc_jax.learning.runs.collect import collect
from parc_jax.proof.absence.prove_no_plan import PROVED, NoPlan
from sims.f110 import few_runs, job
from sims.f110.lesson import Fold, as_if_of, fitted
from sims.f110.rows import Row, sentence, table
from sims.f110.system import seen_as, system


def test_bad_input_is_refused_with_code_2_before_anything_is_run(tmp_path, capsys):
    for arguments, word in (
        (["--rollouts", "12"], "at least 30"),
        (["--eps", "0.1"], "eps: expected an option of"),
    ):
        with pytest.raises(SystemExit) as stop:
            main(["run", "f110", "--out", str(tmp_path / "new"), "--no-cache", *arguments])
        said = capsys.readouterr()
        assert stop.value.code == 2 and word in said.err and not said.out
    assert not (tmp_path / "new").exists()


def test_intervals_bounds_and_promises_have_their_confidence():
    row = Row(60, "published", "network", None, 0, (0.1, 0.1, 0.1), plan=(0.0,), failed_1000=4)
    said, (head, line, foot) = sentence(row), table([row])
    assert "(so 0.109 to 1.03 % of the time, with 95 % confidence)" in said  # 0.1091 to 1.0209 %
    assert "of 1,000 failed (95 %)" in head and "4 (0.109..1.03 %)" in line
    assert "eps holds with at least 95 %" in foot and "of a published claim none" in foot


@pytest.mark.parametrize("status", [Status.NO_PLAN, Status.NOT_FOUND])
def test_that_nothing_was_found_is_told_as_no_proof(status, monkeypatch):
    kind = PROVED if status is Status.NO_PLAN else "undecided"
    absence = NoPlan(kind, Fraction(1), Fraction(1), Fraction(2))
    found = SimpleNamespace(status=status, absence=absence)
    planner = SimpleNamespace(solve=lambda *_: found)
    monkeypatch.setattr(few_runs, "Planner", lambda _: planner)
    model = SimpleNamespace(
        tube=SimpleNamespace(final=np.ones((1, 5))), claim=SimpleNamespace(eps=None)
    )
    learned = SimpleNamespace(model=model, claim="published", fitted="network")
    row = few_runs.attempt(SimpleNamespace(points=()), None, 60, learned, None).row
    said, (_, line, _) = sentence(row), table([row])
    assert "no safe plan found" in line and "NO SAFE PLAN" not in said
    assert ("This is not a proof" in said) == (status is Status.NOT_FOUND)
    assert ("Proved in exact arithmetic" in said) == (status is Status.NO_PLAN)


def test_files_of_an_older_study_are_gone_where_nothing_is_found(tmp_path, monkeypatch, capsys):
    older = ("answer.json", "model.npz", "film.gif", "repeats_60_honest.png", "tubes.pdf")
    for name in (*older, "mine.txt"):
        (tmp_path / name).touch()
    runs = SimpleNamespace(select=lambda rows: None)
    nothing = {"try_starts": None, "collect": runs, "seen_as": None, "models": []}
    for name, found in nothing.items():
        monkeypatch.setattr(sys.modules[job.__module__], name, lambda *_, found=found, **__: found)
    assert job(out=tmp_path, rollouts=60, figures=False, quiet=True) == 1
    assert {one.name for one in tmp_path.iterdir()} == {"mine.txt", "metrics.json", "table.txt"}
    assert "Verify with" not in capsys.readouterr().out


@pytest.mark.night
def test_a_small_laboratory(tmp_path, capsys):
    """Sixty runs by the shell's command: no honest plan, which is exit code 1 and not bad input,
    for a reason.
    """
    with pytest.raises(SystemExit) as stop:
        main(
            [
                "run",
                "f110",
                "--rollouts",
                "60",
                "--out",
                str(tmp_path),
                "--quiet",
                "--json",
                "--no-cache",
            ]
        )
    said = capsys.readouterr()
    metrics = json.loads(said.out)
    assert (
        stop.value.code == 1
        and said.err == ""
        and metrics == json.loads((tmp_path / "metrics.json").read_text())
    )
    rows = metrics["rows"]
    assert rows[0]["plan"] is not None
    assert rows[1]["plan"] is None and "narrower than the tube at the end" in rows[2]["why"]
    assert [r["claim"] for r in rows] == ["published", "honest", "honest, strict"]
    assert rows[0]["eps"] is None and rows[2]["eps"] == pytest.approx(
        1 - 0.025 ** (1 / 30), rel=1e-4
    )
    assert (tmp_path / "table.txt").read_text().count("60 runs") == 3
    for name in ("sideslip", "tubes", "more_runs"):
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000
    assert (tmp_path / "repeats_60_published.png").exists() and not (
        tmp_path / "answer.json"
    ).exists()
    assert (tmp_path / "film.gif").exists() != ("no_film" in metrics)
    for row in rows:
        assert (row["plan"] is None) == (row["why"] != "")


@pytest.mark.night
def test_a_disc_is_seen_in_the_runs_of_a_rectangle():
    key = jax.random.PRNGKey(3)
    wide, narrow = (
        collect(system(body=body), key, 3, Stage.TRAIN, quiet=True)
        for body in ("rectangle", "disc")
    )
    np.testing.assert_array_equal(seen_as("disc", wide).hashes(), narrow.hashes())
    assert seen_as("disc", wide).law == narrow.law and seen_as("rectangle", wide) is wide
    with pytest.raises(InputError, match="front left"):
        seen_as("rectangle", narrow)


@pytest.mark.night
def test_errors_of_moved_runs_are_those_of_the_fit_that_has_not_seen_them():
    runs = collect(system(), jax.random.PRNGKey(4), 20, Stage.TRAIN, quiet=True)
    part = runs.select(slice(10, 20))
    unseen = fitted("affine", runs.select(slice(0, 10)), None)
    own = fitted("affine", runs, None)
    moved = measure(own, as_if_of(own, Fold(unseen, part)))
    for found, wanted in zip(moved, measure(unseen, part), strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-9)
    assert np.abs(np.asarray(measure(own, part).final) - np.asarray(moved.final)).max() > 1e-3
