"""The log of a real robot: its frames, its law, its halves, and what the study says of it."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

import sims
from parc_jax.app import cli
from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.study import replay
from parc_jax.common.errors import InputError, SoundnessError
from parc_jax.learning.network.fit import fit_affine
from parc_jax.learning.network.train import training_arrays
from sims.foreign.husky import bays, compare, learn, twist
from sims.foreign.husky import log as logs
from sims.foreign.husky import params as c
from sims.foreign.husky.job import job, tally, told
from sims.recorded import replay_recorded

GAIN = np.array([[0.08, 0.07], [-0.02, 0.03], [-0.17, 0.16]])


@pytest.fixture(scope="module")
def log():
    return logs.read_log()


@pytest.fixture(scope="module")
def runs(log):
    return learn.halves(log)


@pytest.fixture(scope="module")
def affine(runs):
    """A network without a hidden layer: poor, and trained in no time."""
    return fit_affine(*training_arrays(runs.train))


def synthetic(n: int = 12, records: int = 61) -> logs.Log:
    """Steps of a robot that moves by a constant twist, integrated as complex numbers; it waits a
    second before it obeys.
    """
    t = np.linspace(0.0, 6.0, records)
    command = np.random.default_rng(3).uniform(*c.COMMANDS, (n, 2))
    forward, leftward, turning = GAIN @ command.T
    since = np.maximum(t - 1.0, 0.0)[None]
    yaw = turning[:, None] * since
    way = (forward + 1j * leftward)[:, None] * (np.exp(1j * yaw) - 1) / (1j * turning[:, None])
    return logs.Log(t, np.stack([way.real, way.imag], axis=-1), yaw, command, np.arange(n))


def test_a_window_starts_at_the_origin_and_heads_along_x():
    cut = synthetic()
    p, yaw = logs.windows(cut)
    t = np.arange(41) * 0.1
    forward, leftward, turning = GAIN @ cut.command.T
    way = (forward + 1j * leftward) / (1j * turning) * (np.exp(1j * np.outer(t, turning)) - 1)
    np.testing.assert_allclose(yaw, np.outer(t, turning).T, atol=1e-12)
    np.testing.assert_allclose(p[..., 0] + 1j * p[..., 1], way.T, atol=1e-12)


def test_the_twist_of_a_robot_that_has_one_is_found():
    cut = synthetic()
    found = twist.identify(np.arange(41) * 0.1, *logs.windows(cut), cut.command)
    np.testing.assert_allclose(found.gain, GAIN, atol=1e-9)
    np.testing.assert_allclose(found.offset, 0.0, atol=1e-9)


def test_halves_share_no_command_and_the_law_is_declared(runs):
    assert runs.train.n == runs.held.n == 100
    assert not np.isin(runs.held.groups, runs.train.groups).any()
    assert runs.held.law.k_law == "uniform" and (runs.held.groups % 2 == 1).all()


def test_the_robot_repeats_what_it_did_and_nothing_else(log):
    robot = sims.load("husky")
    again = robot.rollout_batch(None, log.command[[7, 3]])
    assert (again.p.reshape(2, 41, 10) == logs.recorded(log).p[[7, 3]]).all()
    with pytest.raises(InputError, match="was never driven"):
        robot.rollout_batch(None, log.command[:1] + 1e-6)


def test_a_hundred_held_out_commands_support_three_percent(affine, runs):
    claim = learn.claimed(affine, runs, 0.1).claim
    assert claim.n == 100 and claim.discard == 0
    assert float(claim.eps) == pytest.approx(1 - 0.05**0.01, abs=1e-6)
    assert "k uniform on K" in claim.details() and "100 calibration recordings" in claim.details()
    loose = learn.claimed(affine, runs, 0.1, "most").claim
    assert float(loose.eps) == 0.1 and loose.discard == 4
    assert (loose.tube.interval <= claim.tube.interval).all()


def test_the_report_says_of_which_confidence_and_of_which_runs_it_is():
    names = ("commands", "commands_with_a_safe_start", "replays", "missed_the_goal", "touched")
    replayed = {**dict.fromkeys([*names, "left_the_tube", "rows_left_out"], 0), "made_the_tube": 97}
    metrics = {
        **{"half_width_driving": [0.1], "half_width_turning": [0.1]},
        **{"eps": 0.0296, "runs_behind_the_claim": 100, "discarded": 0, "status": "found"},
        **{"first_look": [], "worst_commands": [], "corridors": 1, "share_of_k": 0.5199},
        **{"promise": 0.05711, "replay": replayed, "stages": {}},
        "unseen": {"later": 0, "runs": 50, "earlier": 0, "eps": 0.05},
    }
    said = told(metrics, SimpleNamespace(details=lambda: ""))
    assert "at least 51 % of all commands have a safe start (99.9 % confidence)" in said
    assert "at most 5.72 % leave the tube (94.9 % confidence: 95 % of the claim, 99.9 % of" in said
    assert "0 left the tube; at least 97 of these, or copies of them, made the tube" in said
    assert "left out\n" not in said and "(claimed at 95 %: at most 5 %)" in said
    replayed |= {"made_the_tube": 0, "rows_left_out": 3}
    said = told(metrics, SimpleNamespace(details=lambda: ""))
    assert "0 left the tube; 3 rows left out of their log, or of the tube's" in said


def test_lower_bounds_of_shares_are_rounded_down(affine, runs, monkeypatch, capsys):
    status = SimpleNamespace(found=True, label="found")
    found = SimpleNamespace(status=status, share_of_k=lambda: 0.5181)
    solved = SimpleNamespace(solve=lambda *_: found)
    monkeypatch.setattr(compare, "Planner", lambda model: solved)
    compare.told("affine", affine, runs, None)
    assert capsys.readouterr().out.endswith("found, at least 51 %\n")
    found.share = SimpleNamespace(share=0.7)
    claim = SimpleNamespace(risk=lambda share: SimpleNamespace(bound=0.05711))
    solved.model = SimpleNamespace(claim=claim)
    monkeypatch.setattr(bays, "load", lambda path: None)
    monkeypatch.setattr(bays, "Planner", lambda model: solved)
    monkeypatch.setattr(bays, "WIDTHS", (1.6,))
    monkeypatch.setattr("sys.argv", ["bays"])
    bays.main()
    head, *rows = capsys.readouterr().out.splitlines()
    assert "at least of K (99.9 %)" in head and len(rows) == 2
    assert all(row.split()[-5:] == ["%", "51", "%", "5.72", "%"] for row in rows)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The whole job: exit code and what it wrote."""
    out = tmp_path_factory.mktemp("husky")
    return job(out=out, quiet=True), out


@pytest.mark.night
def test_the_study_finds_plans_and_no_held_out_run_breaks_them(study):
    code, out = study
    metrics = json.loads((out / "metrics.json").read_text())
    assert code == 0
    with pytest.raises(SystemExit) as checked:
        cli.main(["check", str(out / "answer.json")])
    assert checked.value.code == 0
    assert metrics["eps"] < 0.03 and metrics["promise"] < 0.1
    replay = metrics["replay"]
    assert replay["commands_with_a_safe_start"] >= 30 and replay["replays"] >= 200
    assert replay["missed_the_goal"] == replay["touched"] == replay["left_the_tube"] == 0
    for name in ("errors", "commands", "paths"):
        assert (out / f"{name}.png").stat().st_size > 10_000


@pytest.mark.night
def test_a_robot_that_strays_is_counted_and_one_that_cannot_fail_is_a_fault(
    study, runs, monkeypatch
):
    """The same answer, against paths that slide a metre to the left on their way."""
    answer = load_answer(study[1] / "answer.json")
    slide = np.tile([0.0, 1.0], 5) * np.linspace(0.0, 1.0, 41)[:, None]
    strayed = runs.held.replace(p=runs.held.p + slide)
    counts = tally(replay_recorded(answer, strayed))
    assert counts["left_the_tube"] == counts["replays"] > 0
    assert counts["touched"] > 0 and counts["missed_the_goal"] > 0
    monkeypatch.setattr(replay, "inside_tube", lambda claim, net, batch: np.ones(batch.n, bool))
    with pytest.raises(SoundnessError, match="contradicts the proof"):
        replay_recorded(answer, strayed)
