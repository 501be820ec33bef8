"""The first safe plans of a list: judged as every plan is, whatever was judged before them."""

import numpy as np
import pytest
from toy_models import random_polygon, toy_case

from parc_jax.drive.loop.scenes import everywhere
from parc_jax.problem.robust.question import question
from parc_jax.safe_set.corridors.first import MOST, preferred
from parc_jax.safe_set.verdict.pointwise import paths_of, verdicts
from parc_jax.safe_set.verdict.scene import laid_out

N = 64


@pytest.fixture(scope="module")
def crowd():
    """A scene whose obstacles stand about the paths from one start, plans, and their verdicts."""
    rng = np.random.default_rng(8)
    model, problem = toy_case(8)
    start = np.array([0.0, 0.0])
    k = rng.uniform(model.domain.lo, model.domain.hi, (N, model.n_k))
    paths = paths_of(model, np.tile(start, (N, 1)), k)
    places = paths[np.arange(8), rng.integers(2, paths.shape[1], 8)] + rng.normal(0, 0.35, (8, 2))
    posts = [random_polygon(rng, place, 0.05) for place in places]
    problem = problem.replace(goal=everywhere(model), start=None, obstacles=posts, spans=())
    scene = laid_out(question(problem, model, start).plain())
    return scene, k, verdicts(scene, np.tile(start, (N, 1)), k)


def test_a_plan_s_verdict_does_not_depend_on_those_before_it(crowd):
    scene, k, seen = crowd
    safe = np.flatnonzero(seen.safe)
    assert 5 < len(safe) < N - 5
    for order in (np.arange(N), np.arange(N)[::-1], np.argsort(seen.clearance)):
        first = order[np.isin(order, safe)][:MOST]
        found = preferred(scene, k[order], MOST)
        np.testing.assert_array_equal(order[found.rows], first)
        np.testing.assert_allclose(found.clearance, seen.clearance[first], atol=1e-12)


def test_none_is_looked_at_after_the_first_that_has_room(crowd):
    scene, k, seen = crowd
    clearance = np.where(seen.safe, seen.clearance, -np.inf)
    room = np.sort(clearance)[-3]
    first = int(np.argmax(clearance >= room))
    found = preferred(scene, k, MOST, room - 1e-9)
    assert found.judged == first + 1 and found.rows[-1] == first
    assert (found.clearance[:-1] < room).all()


def test_none_is_begun_after_so_many_looks(crowd):
    """The work of a call has a limit; what was not judged is not among the safe ones."""
    scene, k, _ = crowd
    whole = preferred(scene, k, MOST)
    assert whole.looks > whole.judged > 10
    for most in (1, whole.looks // 2):
        found = preferred(scene, k, MOST, looks=most)
        assert most <= found.looks < most + len(scene.problem.obstacles)
        assert found.judged < whole.judged
        n = len(found.rows)
        np.testing.assert_array_equal(found.rows, whole.rows[:n])
        assert (whole.rows[n:] >= found.judged).all()
