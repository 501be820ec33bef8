"""Nothing is lost: places are tried first, unfinished runs stay until the result is on disk, one
command at a time writes to a folder, and what does not fit is refused before the first run.
"""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import toy_cart
import toy_driven
from synthetic_plants import plant

import parc_jax as pj
from parc_jax.app import cli
from parc_jax.app.cli.places import held
from parc_jax.app.study import job
from parc_jax.app.study.settings import Study
from parc_jax.learning.bound.settings import ModelBound
from parc_jax.learning.runs.law import subject_of
from parc_jax.learning.systems.chained import LEFT
from parc_jax.safe_set.settings import Settings

STUDY = Study(repeats=1, settings=Settings(samples=5, budget_s=300, target=0.3))


@pytest.fixture
def shell(capsys, monkeypatch, tmp_path):
    """Run a command line in an empty folder: (exit code, what it complained of). No run is made."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(Path(toy_cart.__file__).parent))

    def no_runs(*_, **__):
        raise AssertionError("a run was made")

    monkeypatch.setattr("parc_jax.learning.bound.start_gap.collect", no_runs)
    monkeypatch.setattr("parc_jax.learning.learn.stream_rollouts", no_runs)

    def run(*arguments):
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            cli.main([*map(str, arguments), "--no-cache"])
        said, complained = capsys.readouterr()
        assert said == "" and complained.count("\n") == 1, complained
        return stop.value.code, complained

    return run


def test_the_target_is_tried_before_the_first_run(shell, tmp_path):
    (tmp_path / "models").mkdir()
    code, why = shell("learn", "toy_cart", "--out", "models", "--rollouts", 100)
    assert code == 2 and "there is a folder of that name. Name a file in it" in why
    (tmp_path / "cart").mkdir()
    (tmp_path / "cart" / "metrics.json").mkdir()
    code, why = shell("run", "toy_cart", "--out", "cart", "--rollouts", 100)
    assert code == 2 and "metrics.json: expected a place for a file" in why
    (tmp_path / "file").touch()
    code, why = shell("run", "toy_cart", "--out", "file")
    assert code == 2 and "file is a file and no folder" in why


def late_stop(monkeypatch, out, *, when, **asked) -> None:
    """A study whose learning is given, stopped in the middle of `when` of the planner."""

    def learn(system, key, study, *, path, first, **_):
        path.mkdir(parents=True)
        (path / "train.npz").write_text("runs")
        if first is not None:
            first(toy_driven.model())
        return SimpleNamespace(model=toy_driven.model())

    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(job, "learn_report", learn)
    monkeypatch.setattr(pj.Planner, when, stop)
    with pytest.raises(KeyboardInterrupt):
        system = plant(toy_driven.gusty, 4)
        job.run_study(system, toy_driven.problem(), STUDY, out, 0, quiet=True, **asked)


def test_a_late_stop_leaves_the_older_study_whole_and_the_new_runs_where_they_are(
    monkeypatch, tmp_path
):
    older = {"model.npz": "older model", "answer.json": "older answer", "metrics.json": "{}"}
    for name, text in older.items():
        (tmp_path / name).write_text(text)
    answer = toy_driven.answer()
    monkeypatch.setattr(pj.Planner, "warm_up", lambda *_, **__: answer)
    late_stop(monkeypatch, tmp_path, when="solve")
    assert {name: (tmp_path / name).read_text() for name in older} == older
    unfinished = tmp_path / "unfinished"
    assert {f.name for f in unfinished.iterdir()} == {"train.npz", "model.npz"}
    assert pj.load(unfinished / "model.npz").tube.hash == toy_driven.model().tube.hash


def test_the_first_proved_plans_are_told_before_the_safe_set_is_searched(monkeypatch, tmp_path):
    """A model that was given has nothing unfinished, and is told of at the end."""
    answer = replace(toy_driven.answer(), samples=np.zeros((1, 4)))
    asked = []
    told = []

    def warm_up(*_, proof=False):
        asked.append(proof)
        return answer

    monkeypatch.setattr(pj.Planner, "warm_up", warm_up)
    monkeypatch.setattr("parc_jax.app.plot.samples.samples", lambda seen, *_: told.append(seen))
    late_stop(monkeypatch, tmp_path, when="solve", figures=True)
    assert asked == [True] and told == [answer]
    late_stop(monkeypatch, tmp_path / "untold", when="solve")
    system, model = plant(toy_driven.gusty, 4), toy_driven.model()
    with pytest.raises(KeyboardInterrupt):
        job.run_study(system, toy_driven.problem(), STUDY, tmp_path, 0, model, figures=True)
    assert asked == [True, False, False] and told == [answer]


@pytest.mark.slow
def test_what_speaks_of_the_older_answer_goes_with_it(monkeypatch, tmp_path):
    for name in ("metrics.json", "near.json"):
        (tmp_path / name).write_text("older")
    model, answer = toy_driven.model(), toy_driven.answer()
    monkeypatch.setattr(pj.Planner, "warm_up", lambda *_, **__: answer)
    monkeypatch.setattr(pj.Planner, "solve", lambda *_, **__: answer)

    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(job, "replay", stop)
    with pytest.raises(KeyboardInterrupt):
        system = plant(toy_driven.gusty, 4)
        job.run_study(system, toy_driven.problem(), STUDY, tmp_path, 0, model, quiet=True)
    assert {f.name for f in tmp_path.iterdir()} == {"model.npz", "answer.json"}


def test_all_but_the_driven_plan_is_there_before_it_is_run(monkeypatch, tmp_path):
    model, answer = toy_driven.model(), toy_driven.answer()
    monkeypatch.setattr(pj.Planner, "warm_up", lambda *_, **__: answer)
    monkeypatch.setattr(pj.Planner, "solve", lambda *_, **__: answer)
    system, study = plant(toy_driven.gusty, 4), STUDY.replace(driven=True, repeats=1)
    there = []

    def drive(*_):
        there.extend(f.name for f in tmp_path.iterdir())
        assert json.loads((tmp_path / "metrics.json").read_text())["replay"] is not None
        raise KeyboardInterrupt

    monkeypatch.setattr(job, "drive", drive)
    question = toy_driven.problem()
    with pytest.raises(KeyboardInterrupt):
        job.run_study(system, question, study, tmp_path, 0, model, quiet=True)
    assert set(there) == {"model.npz", "answer.json", "metrics.json"}


HOLDS = """
import sys, time
from pathlib import Path
from parc_jax.app.cli.places import held
with held(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(3600)
"""


def test_a_place_is_held_by_one_process_and_taken_over_from_a_dead_one(tmp_path):
    out = tmp_path / "runs" / "cart"
    command = [sys.executable, "-c", HOLDS, out]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as holder:
        try:
            assert holder.stdout.readline() == "held\n"
            with pytest.raises(pj.InputError, match="nobody else writes to; another process does"):
                with held(out):
                    pass
        finally:
            holder.kill()
    for _ in range(2):
        with held(out), pytest.raises(pj.InputError), held(out):
            pass
    assert list(out.parent.iterdir()) == []


GOALS = {
    "not of this many coordinates": (
        pj.box([0, 0, 0], [1, 1, 1]),
        0.1,
        "expected a set over the 2",
    ),
    "without a bound": (
        pj.hpolytope([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]], [1.0, 1.0, 1.0]),
        0.1,
        "axis 1 has no bound",
    ),
    "of a body with other points": (
        pj.box([0, 0], [1, 1]),
        pj.body_of([pj.problem.hull("nose", "tail")]),
        "part 0 of the body: expected reference points",
    ),
}


@pytest.mark.parametrize("case", GOALS)
def test_a_question_that_does_not_fit_is_refused_before_the_first_run(
    shell, tmp_path, monkeypatch, case
):
    goal, body, why = GOALS[case]
    scene = pj.reach_avoid(goal, [], body)
    monkeypatch.setattr(toy_cart, "problem", lambda: scene)
    code, complained = shell("run", "toy_cart", "--quiet")
    assert code == 2 and why in complained
    assert list(tmp_path.iterdir()) == []


DOUBTS = [
    (pj.Uncertainty(goal=0.01), {"driven", "risk"}),
    (pj.Uncertainty(start=0.01, sensing_eps="1e-3"), {"driven", "risk"}),
    (pj.Uncertainty(k={0: 0.01}), {"driven", "risk", "repeats"}),
    (pj.Uncertainty(given={0: 0.7}), {"driven", "risk"}),
    (pj.Uncertainty(unknown={0: (0.7, 0.8)}), {"driven", "risk", "repeats"}),
    (pj.Uncertainty(), set()),
]


@pytest.mark.parametrize(("doubt", "cannot"), DOUBTS)
def test_what_cannot_be_made_under_an_uncertainty_is_refused_where_it_is_asked_for(
    shell, tmp_path, monkeypatch, doubt, cannot
):
    scene = toy_cart.problem().replace(uncertainty=doubt)
    monkeypatch.setattr(toy_cart, "problem", lambda: scene)
    assert set(job.unmade(scene, subject_of(toy_cart.Cart()), "uniform")) == cannot
    for name, value in {"driven": True, "risk": 0.05, "repeats": 50}.items():
        if name in cannot:
            code, why = shell("run", "toy_cart", f"--{name}", value, "--quiet")
            assert code == 2 and why.endswith("got one under an uncertainty. Leave it out.\n")
            assert f"parc-jax: {name}: expected" in why and list(tmp_path.iterdir()) == []


def test_of_a_robot_that_moves_or_is_measured_at_the_start_less_is_made():
    cart = subject_of(toy_cart.Cart())
    moving = f"a chain of 3 manoeuvres before it, {LEFT}0.2 to 0.6 s"
    assert set(job.unmade(toy_cart.problem(), cart, moving)) == {"driven", "repeats"}
    assert set(job.unmade(toy_cart.problem(), replace(cart, given=(0,)), "uniform")) == {"risk"}


def test_what_a_study_leaves_out_is_told(monkeypatch, tmp_path):
    """A default of the system's study that cannot be made of this problem."""
    from parc_jax.app.study.report import report

    model, answer = toy_driven.model(), replace(toy_driven.answer(), samples=np.zeros((0, 4)))
    monkeypatch.setattr(pj.Planner, "warm_up", lambda *_, **__: answer)
    monkeypatch.setattr(pj.Planner, "solve", lambda *_, **__: answer)
    study = STUDY.replace(driven=True, risk=0.05, repeats=20)
    system = plant(toy_driven.gusty, 4)
    scene = toy_driven.problem().replace(uncertainty=pj.Uncertainty(k={0: 0.01}))
    outcome = job.run_study(system, scene, study, tmp_path, 0, model, quiet=True)
    why = "(under an uncertainty)"
    left = f"the validated set {why}, the plan to drive {why}, the replay {why}"
    assert f"\nNot made: {left}.\n" in report(outcome, tmp_path)


def test_a_saved_model_of_another_system_is_refused(shell, tmp_path):
    toy_driven.model().save(tmp_path / "m.npz")
    code, complained = shell("run", "toy_cart", "--model", "m.npz", "--quiet")
    assert code == 2 and ", beside cart" in complained


def test_the_report_tells_the_eps_of_the_claim_in_hand(monkeypatch, tmp_path):
    from parc_jax.app.study.report import report

    model, answer = toy_driven.model(), toy_driven.answer()
    monkeypatch.setattr(pj.Planner, "warm_up", lambda *_, **__: answer)
    monkeypatch.setattr(pj.Planner, "solve", lambda *_, **__: answer)
    study = Study(repeats=1, bound=ModelBound(eps=0.001), settings=Settings(samples=5))
    system = plant(toy_driven.gusty, 4)
    outcome = job.run_study(system, toy_driven.problem(), study, tmp_path, 0, model, quiet=True)
    told = report(outcome, tmp_path)
    assert float(model.claim.eps) == 0.1
    by = "left with probability ≤ 0.1 by a run, k drawn uniformly from all of K, confidence 0.95"
    law = model.claim.law.describe()
    assert f"left the tube (claimed of {law}: {by})" in told and "0.001" not in told
    assert told.count("\n") < 15
