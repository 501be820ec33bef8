"""Yield: truth by simulation equals what is certified where the model is exact."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from synthetic_plants import disturbed, exact, plant, straight_network
from toy_system import STUDY

from benchmarks.bench import Bench
from benchmarks.report import EXPLAINED
from benchmarks.result import Skip
from benchmarks.workloads import workload
from benchmarks.yields import Setting, Task, tasks
from parc_jax.common.sets.box import box
from parc_jax.learning.bound.declared import declared_claim
from parc_jax.learning.bound.tube import zero_tube
from parc_jax.learning.model import trajectory_model
from parc_jax.problem.problem import reach_avoid

pytestmark = pytest.mark.slow

measured = workload("yield")


class Small(Bench):
    """Sizes between a quick look and a measurement."""

    def size(self, full, quick):
        return {400: 200, 200: 40, 2000: 200, 1 << 13: 1 << 12}.get(full, quick)


def scene():
    """A goal of 1 x 1 x 2 and a wall that part of the paths to it cross."""
    return reach_avoid(
        box([0.0, 0.0, -0.5], [1.0, 1.0, 1.5]), [box([0.3, 0.2], [0.4, 0.6])], body=0.05
    )


def toy(run):
    system = plant(run)
    task = Task("toy", "toy", lambda: system, scene, (), chance=run is not exact)
    none = zero_tube(([0.0, 1.0], [0.0, 1.0]), 4, 2, 3)
    net = straight_network(4)
    model = trajectory_model(net, declared_claim(none, "the model is exact", net, system.time))
    return task, system, model


@pytest.mark.night
def test_where_the_model_is_exact_all_that_succeeds_is_certified():
    task, system, model = toy(exact)
    bench = Small(quick=True)
    truth = measured.truly_safe(task, system, model, bench)
    found = measured.certified(scene(), model, model.claim, bench)
    assert 0.1 < truth.value < 0.9
    assert truth.low <= found.high and found.low <= truth.high


def test_every_setting_of_a_system_has_the_same_eps_delta_and_number_of_runs():
    for task in tasks(quick=False):
        studies = [s.study for s in task.settings]
        assert len({(s.bound.eps, s.bound.delta, s.bound.blocks is None) for s in studies}) == 1
        assert len({s.runs for s in task.settings}) == 1
        assert len({s.key for s in task.settings}) == len(task.settings)


def test_truth_says_how_many_runs_of_a_plan_it_rests_on_and_its_confidence():
    said = " ".join(EXPLAINED["yield"].split())
    for task in tasks(quick=False):
        name = task.name.partition("_")[0]
        assert (
            f"of {task.repeats} ({name})" if task.chance else f"one run without chance ({name}"
        ) in said
    assert "95 %" in said


def test_nothing_of_nothing_is_no_yield_and_more_than_succeeds_is_told(monkeypatch):
    """Of a system that cannot run here, one where nothing succeeds, and one where it is all."""
    none, some, most = (measured.Share(x, x / 2, x) for x in (0.0, 0.2, 0.4))
    found = {
        "nothing": (none, none),
        "wrong": (none, some),
        "few": (measured.Share(0.0, 0.0, 0.05), measured.Share(1e-3, 1e-4, 4e-3)),
        "more": (some, most),
        "half": (most, some),
    }
    setting = SimpleNamespace(key="a", name="boxes", runs=7)

    def of_task(bench, task):
        if task.name == "missing":
            raise Skip("no simulator")
        yield setting, "one", *found[task.name]

    every = [SimpleNamespace(name=name, title=name) for name in ("missing", *found)]
    monkeypatch.setattr(measured, "tasks", lambda quick: every)
    monkeypatch.setattr(measured, "_of_task", of_task)
    result = measured.run(Bench(quick=True))
    (table,) = result.tables
    assert {len(row) for row in table.rows} == {len(table.header)}
    told = {row[0]: row[-1] for row in table.rows}
    assert told["nothing"] == told["missing"] == told["few"] == ""
    assert told["wrong"] == "**more certified than truly succeed**"
    assert told["half"] == "50 % (25 % to 100 %)"
    assert [bar[0] for bar in result.data["bars"]] == ["more", "half"]


def test_plans_of_which_none_or_all_succeed_leave_the_truth_an_interval(monkeypatch):
    place = SimpleNamespace(z_lo=np.zeros(2), z_hi=np.ones(2))
    task, model = (
        SimpleNamespace(chance=False, problem=scene),
        SimpleNamespace(domain=box([0.0, 0.0], [1.0, 1.0]), n_k=2, n_p=2),
    )
    monkeypatch.setattr(measured, "scene_of", lambda problem, model: place)
    monkeypatch.setattr(
        measured, "collect", lambda *_, k, **__: SimpleNamespace(p=np.zeros((len(k), 1, 2)))
    )
    for all_of_them in (False, True):
        shares = np.full(measured.ENDS * 10, all_of_them)
        monkeypatch.setattr(measured, "_succeed", lambda *_, shares=shares: shares)
        told = measured.truly_safe(task, None, model, Bench(quick=True))
        assert told.value == all_of_them and told.high - told.low == pytest.approx(0.31, abs=0.01)


@pytest.mark.night
def test_settings_share_their_runs_and_get_claims_of_their_own(monkeypatch, tmp_path):
    one = STUDY.replace(
        hidden=(2,),
        profile_runs=60,
        fresh=150,
        eps=0.2,
        delta=0.2,
        blocks=(1, 1),
        steps=30,
    )
    two = one.replace(rollouts=120, profile_runs=0, shape="fitted", blocks=(1, 1))
    settings = (Setting("a", "boxes", one), Setting("b", "fitted", two))
    task = replace(toy(disturbed)[0], settings=settings)
    monkeypatch.setattr(measured, "tasks", lambda quick: (task,))
    result = measured.run(Bench(quick=True))
    keys = [m.key for m in result.metrics]
    rows = [f"yield.toy.{kind}.{s}" for s in "ab" for kind in ("bins", "one")]
    assert keys == ["yield.toy.truth", *rows]
    assert [row[3] for row in result.tables[0].rows] == ["270"] * 4
    measured.figure(result.data, tmp_path / "yield.png")
    assert (tmp_path / "yield.png").stat().st_size > 1000
