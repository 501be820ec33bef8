"""The models that come along with the systems: each is what its study makes of the system as it is
now, and an answer from nothing but the package is checked.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from toy_models import line_model

import parc_jax as pj
import sims
from parc_jax import checker
from parc_jax.app import cli
from parc_jax.app.cli.systems import black_box_of, find, scene_of, study_of
from parc_jax.common.keys import Stage, key_of
from parc_jax.learning.bound.measure import allowance, score_arrays
from parc_jax.learning.runs.collect import simulate_rows
from parc_jax.learning.runs.law import law_of
from parc_jax.safe_set.verdict.outline import require_same

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data"
# as docs/main_job.md tells; others are learned with the settings of their study
MADE_BY = {
    "drift_parking": "--plant ode --rollouts 1500 --hidden 8 8 --seeds 2 --steps 600 --eps 0.02 "
    "--delta 0.05 --bins 8 3"
}
CHEAP = "drift_parking"  # learned in a minute


def subject(name: str):
    """A system on the plant that its model was learned on, and the model."""
    module, model = find(name), sims.model(name)
    plant = dict(model.claim.law.parameters).get("plant")
    return black_box_of(module, plant, study_of(module).body), model


@pytest.mark.parametrize("name", sims.models())
def test_its_claim_is_about_the_system_as_it_is(name):
    system, model = subject(name)
    require_same(system, model)
    assert model.claim.law == law_of(system) and model.claim.kind == "pac"
    assert any(one.startswith("UNSEEN(1 look; ") for one in model.claim.assumptions)
    assert sims.model_file(name).stat().st_size < 1_000_000


@pytest.mark.slow
@pytest.mark.parametrize("name", sims.models())
def test_the_worst_runs_of_its_claim_are_those_of_the_system(name):
    """Whoever changes the code of a plant learns its model anew."""
    system, model = subject(name)
    evidence = model.claim.evidence
    rows = np.array([run["row"] for run in evidence["worst"]])
    assert evidence["seed"] == [0, 0]
    k, runs = simulate_rows(system, key_of(0), Stage(evidence["stage"]), rows)
    told = [[float.fromhex(x) for x in run["k"]] for run in evidence["worst"]]
    np.testing.assert_array_equal(k, told)
    slack = allowance(model.net, model.domain, model.layout)
    now = score_arrays(model.net, slack, model.tube, k, np.asarray(runs.p), np.asarray(runs.q))[0]
    then = np.array([float.fromhex(run["score"]) for run in evidence["worst"]])
    # one scale for all of K, or one for each bin
    scale = evidence.get("bin_scale", [evidence.get("scale")] * model.tube.n_bins)
    of_run = model.tube.bin_of(np.array(told))
    then /= np.array([float.fromhex(scale[i]) for i in of_run])
    # what starts may matter has widened the tube since
    assert (now <= 1.01 * then).all() and (now > 0.9 * then).any()


@pytest.mark.smoke
@pytest.mark.slow
@pytest.mark.parametrize("name", sims.models())
def test_a_first_plan_from_nothing_but_the_package_is_proved(name, tmp_path):
    """On no device at all, so nothing is compiled."""
    out = tmp_path / "answer.json"
    command = [sys.executable, "-m", "parc_jax.app.cli", "solve", name, "--first", "--out", out]
    env = os.environ | {"JAX_PLATFORMS": "none"}
    subprocess.run(command, cwd=ROOT, env=env, check=True)
    assert checker.main([str(out)]) == 0
    assert len(pj.load_answer(out).samples) == 1


@pytest.mark.night
def test_learned_anew_it_is_of_the_same_runs_and_much_as_wide(tmp_path):
    """The same runs; of the network, trained in single precision, what another processor makes of
    them.
    """
    asked = [*MADE_BY.get(CHEAP, "").split(), "--out", str(tmp_path / "model.npz")]
    with pytest.raises(SystemExit) as stop:
        cli.main(["learn", CHEAP, *asked, "--quiet", "--no-cache"])
    assert not stop.value.code
    again, model = pj.load(tmp_path / "model.npz", system=CHEAP), sims.model(CHEAP)
    for name in ("law", "eps", "delta", "n", "discard", "looks", "assumptions"):
        assert getattr(again.claim, name) == getattr(model.claim, name)
    assert again.claim.evidence["train"] == model.claim.evidence["train"]
    wider = again.tube.final / model.tube.final  # by bin; of 149 runs the worst one decides
    assert 0.8 < np.median(wider) < 1.25 and wider.min() > 1 / 3 and wider.max() < 3


def test_a_model_is_asked_about_its_systems_scene_with_the_body_that_has_its_points():
    disc, turning = pj.load(DATA / "drift_4x8.npz"), sims.model("drift_parking")
    for model, body in ((disc, "disc"), (turning, "rectangle")):
        assert repr(scene_of(model)) == repr(sims.drift_parking.problem(body))
    with pytest.raises(pj.InputError, match="known of a scene of 'toy'"):
        scene_of(line_model(2, 0.1))
