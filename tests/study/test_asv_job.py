"""The boat through the main job with few rollouts: settings, both scenarios, files, an answer the
checker accepts.
"""

import json

import pytest

import sims
from parc_jax import checker
from parc_jax.app.cli.systems import build
from parc_jax.app.study.job import run_study
from parc_jax.common.status import Status
from sims import asv, asv_published

FEW = {
    "hidden": (6, 6),
    "bins": (1, 3, 1),
    "blocks": (1, 3, 1),
    "rollouts": 500,
    "eps": 0.2,
    "delta": 0.05,
    "fresh": 400,
    "profile_runs": 300,
    "seeds": 2,
    "steps": 1000,
    "samples": 4,
    "repeats": 6,
    "target": 0.3,
    "budget_s": 300.0,
}


def test_settings_are_those_of_the_scenario():
    for study in (asv.STUDY, asv_published.STUDY):
        assert study.bound.eps == 1e-2 and study.bound.blocks == (3, 3, 3)
        assert study.hidden == (8, 8, 8, 8) and study.repeats >= 100
        assert study.plant == "ode"  # bulk runs; the replay stays on the simulator of record


@pytest.mark.night
@pytest.mark.parametrize("name", ["asv", "asv_published"])
def test_few_rollouts_end_in_a_proved_answer(name, tmp_path):
    study, boat = asv.STUDY.replace(**FEW), sims.load(name, plant="ode")
    outcome = run_study(boat, asv.problem(), study, tmp_path, seed=0, quiet=True, figures=True)
    assert outcome.answer.status.found and outcome.answer.status is Status.PROVED
    assert checker.main([str(tmp_path / "answer.json")]) == 0
    seen = json.loads((tmp_path / "metrics.json").read_text())
    assert seen["replay"]["runs"] == 24 and seen["claim"]["bin_eps"] == ["1/5"] * 3
    assert set(seen["figures"]) == {"samples.png", "regions.png"}


@pytest.mark.parametrize("module", [asv, asv_published])
def test_the_plants_that_the_main_job_asks_for_can_be_built(module):
    for plant in (module.STUDY.plant, None):
        assert build(module, "system", plant=plant).plant == (plant or "mjx")
