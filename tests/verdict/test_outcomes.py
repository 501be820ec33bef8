"""Distances of recorded runs, told by facets where they can be, against every hull measured."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from toy_models import told
from turning_bar import Bar, straight_bar

import parc_jax as pj
from benchmarks.replays import counts_of
from parc_jax.app.study import replay as replaying
from parc_jax.app.study.replay import replay
from parc_jax.common.arrays import x64
from parc_jax.common.errors import SoundnessError
from parc_jax.common.keys import Stage
from parc_jax.learning.bound.error_set import ErrorBox
from parc_jax.learning.runs.collect import collect
from parc_jax.safe_set.verdict.outcomes import outcomes, reached_and_touched
from parc_jax.safe_set.verdict.scene import scene_of
from sims.boxes_of_k import under

KEY = jax.random.PRNGKey(7)
pytestmark = pytest.mark.slow  # kernels of its own: of the gate
GOAL = pj.problem.goal_of_points(
    Bar.points, {"tail": pj.box([-0.3, -0.3], [0.3, 0.3])}, pj.box([-1], [1])
)
BLOCKS = (pj.box([-0.45, 0.3], [-0.25, 0.6]), pj.box([-0.3, -0.9], [-0.28, -0.5]))
BODY = pj.body_of(
    [pj.problem.hull("tail", "nose", radius=0.05), pj.problem.hull("nose", radius=0.1)]
)


def asked(body=BODY, blocks=BLOCKS, spans=((0, 3), (2, 3))):
    """Scene, runs and starts of bars that pass the blocks, many of them through one."""
    model = straight_bar()
    problem = pj.reach_avoid(GOAL, blocks, body).replace(spans=spans)
    rng = np.random.default_rng(0)
    k = rng.uniform(Bar.domain.lo, Bar.domain.hi, (300, 2))
    p0 = np.stack([-k[:, 0], np.zeros(300)], axis=1)
    p0 += rng.uniform([-0.3, -1.8], [0.3, 0.8], (300, 2))
    runs = collect(Bar(), KEY, 300, Stage.REPLAY, k=k, quiet=True)
    return scene_of(problem, model), runs, p0


def every_hull(scene, stride, path):
    """(n,) least distance of paths over all pairs and all intervals between records, each asked
    for itself.
    """
    obstacles = scene.obstacles
    still = ErrorBox(jnp.zeros((path.shape[1] - 1, 2, 2)))
    with x64():
        gaps = np.asarray(jax.lax.map(lambda one: obstacles.gaps(one, still)[0], path))
    active = obstacles.active.repeat(stride, axis=1)
    return np.where(active, gaps, np.inf).min(axis=(1, 2))


def test_distances_are_those_of_every_hull_measured():
    scene, runs, p0 = asked()
    path, _, distance = outcomes(scene, runs, p0)
    truth = every_hull(scene, runs.time.stride, path)
    apart = truth > 0
    assert 50 < apart.sum() < 250
    np.testing.assert_allclose(distance[apart], truth[apart], atol=1e-12)
    assert (distance[~apart] <= 0).all()


def test_touched_is_what_a_distance_says():
    scene, runs, p0 = asked()
    _, reached, distance = outcomes(scene, runs, p0)
    again, touched = reached_and_touched(scene, runs, p0)
    np.testing.assert_array_equal(again, reached)
    np.testing.assert_array_equal(touched, ~(distance > 0))
    assert 50 < touched.sum() < 250
    nearer = reached_and_touched(scene, runs, p0, off=0.1)[1]  # of the diagonal of both coordinates
    np.testing.assert_array_equal(nearer, ~(distance > 0.1 * np.sqrt(2)))
    assert touched.sum() < nearer.sum() < 300


def test_without_obstacles_nothing_is_near():
    scene, runs, p0 = asked(blocks=(), spans=())
    assert np.isinf(outcomes(scene, runs, p0)[2]).all()
    assert not reached_and_touched(scene, runs, p0)[1].any()


def test_a_failed_run_has_touched():
    scene, runs, p0 = asked()
    p = runs.p.copy()
    p[3] = np.nan
    failed = runs.replace(p=p)
    assert not outcomes(scene, failed, p0)[2][3] > 0
    assert reached_and_touched(scene, failed, p0)[1][3]


def test_counts_are_those_of_a_replay():
    scene, runs, p0 = asked()
    plans = np.concatenate([p0, runs.k], axis=1)
    seen = replay(Bar(), scene, plans, KEY)
    assert counts_of(Bar(), scene, plans, KEY) == {
        "plans": 300,
        "reached": seen.reached.sum(),
        "touched": seen.touched.sum(),
        "left the tube": (~seen.inside).sum(),
    }
    assert seen.inside.sum() < 100  # the model knows nothing of turns


def test_a_contradiction_among_many_is_reported(monkeypatch):
    """A tube that holds every run, and plans that the model sends through a block: nobody proved
    them, but where a verdict believes all.
    """
    scene, runs, p0 = asked()
    plans = np.concatenate([p0, runs.k], axis=1)
    model = straight_bar()
    tube = model.claim.tube
    wide = tube.replace(interval=tube.interval + 5, final=tube.final + 5)
    model = told(model, tube=wide)
    reached, touched = reached_and_touched(scene, runs, p0)
    failed = (touched | ~reached).sum()
    assert 0 < (touched & ~reached).sum() < failed < 300
    seen = counts_of(Bar(), under(scene, model), plans, KEY)
    assert (seen["touched"], seen["left the tube"]) == (touched.sum(), 0)
    believing = SimpleNamespace(safe=True)
    monkeypatch.setattr(replaying, "verdicts", lambda *_: believing)
    with pytest.raises(SoundnessError, match=f"{failed} of 300 plans failed"):
        counts_of(Bar(), under(scene, model), plans, KEY)
