"""Recorded runs against an answer: moved to proved starts, judged as every replay is."""

from types import SimpleNamespace

import numpy as np
import pytest
import toy_query

import parc_jax as pj
from parc_jax.app.study import replay as replaying
from parc_jax.common.errors import InputError, SoundnessError
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.bound.fresh import SEEN, SHAPE, short_ids
from parc_jax.learning.network.predict import trajectories
from parc_jax.learning.runs.batch import rollout_batch
from parc_jax.learning.runs.law import OURS, law_spec
from sims.recorded import replay_recorded

N = 40


@pytest.fixture(scope="module")
def answer():
    return toy_query.answer()


@pytest.fixture(scope="module")
def runs(answer):
    """What a robot did with k drawn from K: as predicted, but for less than the tube."""
    model, rng = answer.model, np.random.default_rng(0)
    k = rng.uniform(model.domain.lo, model.domain.hi, (N, model.n_k))
    offsets, q = trajectories(model.net, model.layout, k)
    knots = np.asarray(offsets)
    at = np.linspace(0, model.time.n_steps, model.time.n_record + 1)
    early = np.minimum(at.astype(int), model.time.n_steps - 1)
    share = (at - early)[None, :, None]
    p = knots[:, early] * (1 - share) + knots[:, early + 1] * share
    p[:, 1:] += rng.uniform(-0.019, 0.019, p[:, 1:].shape)
    law = law_spec("file:log", model.domain, "logged")
    return rollout_batch(k, p, q, time=model.time, domain=model.domain, law=law)


def test_runs_inside_the_tube_reach_and_touch_nothing(answer, runs):
    found = replay_recorded(answer, runs)
    assert (
        found.with_start.any() and (np.unique(found.row) == np.flatnonzero(found.with_start)).all()
    )
    p0, k = np.split(found.plans, [answer.model.n_p], axis=1)
    assert answer.contains(p0, k).all() and (k == runs.k[found.row]).all()
    np.testing.assert_allclose(found.runs.path, runs.p[found.row] + p0[:, None], atol=1e-12)
    assert found.runs.inside.all() and not found.runs.failed.any()
    said = found.details()
    assert f"At least {found.with_start.sum()} of {N} recorded runs have a k" in said
    assert "0 left the tube, 0 missed the goal, 0 touched an obstacle" in said


def test_under_a_tube_that_nothing_showed_no_start_is_said_to_be_safe_alone(answer, runs):
    model = answer.model
    claim = pj.learning.declared_claim(model.tube, "the tests say so", model.net, model.time)
    asked = SimpleNamespace(model=model.replace(claim=claim), **shown(answer))
    said = replay_recorded(asked, runs).details()
    assert "a start that is shown to be safe under a declared tube; of" in said


def shown(answer):
    return {name: getattr(answer, name) for name in ("scene", "starts")}


def test_runs_that_made_the_tube_and_rows_left_out_are_said(answer, runs):
    """Half of them sized the tube; of another log every fourth row failed and was left out."""
    sized = [SHAPE, "log", None, None, sorted(short_ids(runs.select(slice(0, N // 2)).hashes()))]
    claim = derived(answer.model.claim, evidence={SEEN: [sized]})
    tested = SimpleNamespace(model=answer.model.replace(claim=claim), **shown(answer))
    found = replay_recorded(tested, runs)
    said, counts = found.details(), found.counts()
    assert counts["made_the_tube"] == N // 2 and counts["rows_left_out"] == 0
    assert f" At least {N // 2} of these runs do not test it: they, copies of them" in said
    assert "whose network does not say what it was trained on" in said
    assert "left out" not in said
    p = np.array(runs.p)
    p[1::4, -1] = np.nan
    found = replay_recorded(answer, runs.replace(p=p).finite)
    said, counts = found.details(), found.counts()
    assert counts["made_the_tube"] == 0 and counts["rows_left_out"] == N // 4
    assert f" {N // 4} rows were left out of their log, or" in said and "made" not in said


def test_windows_that_never_became_runs_are_said(answer, runs):
    """As of bags that were loaded with short="dropped"."""
    told = {f"{OURS}dropped": "1,010 left out", f"{OURS}still": "2 left out"}
    law = law_spec("file:log", runs.domain, "logged", told)
    found = replay_recorded(answer, runs.replace(law=law))
    assert found.counts()["windows_left_out"] == 1012 and found.counts()["rows_left_out"] == 0
    said = found.details()
    assert "k as logged, dropped = 1,010 left out, still = 2 left out; " in said
    assert " 1,012 windows never became runs. Assumes of the others: FRESH(" in said
    found = replay_recorded(answer, runs)
    assert found.counts()["windows_left_out"] == 0 and "windows" not in found.details()


def test_runs_that_stray_are_counted_and_ones_that_cannot_fail_are_a_fault(
    answer, runs, monkeypatch
):
    slide = np.linspace(0.0, 0.7, runs.p.shape[1])[None, :, None]
    strayed = runs.replace(p=runs.p + slide)
    seen = replay_recorded(answer, strayed).runs
    assert not seen.inside.any() and seen.failed.all()
    monkeypatch.setattr(replaying, "inside_tube", lambda claim, net, batch: np.ones(batch.n, bool))
    with pytest.raises(SoundnessError, match="contradicts the proof"):
        replay_recorded(answer, strayed)


def test_the_open_door_takes_plans_of_the_runs_own_k(answer, runs):
    model, scene = answer.model, answer.scene
    found = replay_recorded(answer, runs)
    mine = runs.select(found.row)
    again = pj.replay(mine, scene, found.plans)
    np.testing.assert_array_equal(again.clearance, found.runs.clearance)
    others = found.plans.copy()
    others[0, -1] += 1e-9
    slower = mine.replace(time=pj.learning.time_grid(2 * model.time.dt, 2 * model.time.t_f))
    wrong = ((mine, others), (mine, found.plans[1:]), (slower, found.plans))
    for batch, plans in wrong:
        with pytest.raises(InputError, match="one run of each plan's own k"):
            pj.replay(batch, scene, plans)


def test_without_a_start_there_is_no_replay(answer, runs):
    wide = pj.box(2 * answer.model.domain.lo, 2 * answer.model.domain.hi)
    outside = runs.replace(k=runs.k + 10.0, domain=wide)
    assert replay_recorded(answer, outside) is None


def test_under_uncertainty_there_is_no_replay(runs):
    with pytest.raises(InputError, match="without uncertainty"):
        replay_recorded(
            SimpleNamespace(
                scene=SimpleNamespace(nominal=SimpleNamespace(uncertainty="of the start"))
            ),
            runs,
        )
