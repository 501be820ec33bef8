"""What is not finite is never inside and never safe, even under a JAX whose least and largest lose
NaN.
"""

import itertools
from dataclasses import fields, replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from dropping_nan import dropping_nan
from one_interval import separation
from synthetic_plants import noisy, plant, straight_network
from toy_bodies import points_model, points_problem
from toy_models import anchored_plans, toy_case

from parc_jax.common.arrays import x64
from parc_jax.common.probes import probe_nan
from parc_jax.learning.bound.error_set import ErrorBox
from parc_jax.learning.bound.measure import Errors, allowance, extremes_many, measure
from parc_jax.learning.network.predict import layout_of
from parc_jax.learning.runs.collect import collect
from parc_jax.safe_set.separation import segment
from parc_jax.safe_set.separation.pairs import Obstacles
from parc_jax.safe_set.verdict import pointwise
from parc_jax.safe_set.verdict.pointwise import CHUNK, clearance, verdict_in_turn, verdicts
from parc_jax.safe_set.verdict.scene import scene_of
from parc_jax.safe_set.verdict.screen import screen

pytestmark = [pytest.mark.smoke, pytest.mark.soundness, pytest.mark.slow]  # own programs: the gate
BAD = (np.nan, np.inf, -np.inf)
RUNS = 1024  # of a chunk of `measure`


@pytest.fixture(scope="module", autouse=True)
def such_a_jax():
    with dropping_nan():
        assert jax.jit(jnp.max)(jnp.full((1000, 16), jnp.nan)) == -jnp.inf
        yield


def test_such_a_jax_is_told_of_and_not_refused():
    found = probe_nan()
    assert found.ok and "is lost in" in found.detail


def spoiled(x, value, at):
    out = np.array(x, np.float64)
    out[at] = value
    return out


@pytest.mark.parametrize("bad", BAD)
def test_a_run_with_one_number_that_is_none_has_an_infinite_error(bad):
    batch = collect(plant(noisy), jax.random.PRNGKey(0), RUNS, quiet=True)
    net, layout = straight_network(4), layout_of(batch)
    slack = allowance(net, batch.domain, layout)
    # along the axes and between them, where one of them does not feel the coordinate
    u = np.array([[1.0, 0.0], [0.0, 1.0], [0.6, 0.8]])
    along = Errors(
        np.broadcast_to(u, (RUNS, layout.n_steps, 1, *u.shape)),
        np.broadcast_to(np.eye(3), (RUNS, 3, 3)),
    )

    def sizes(runs):
        with x64():
            extremes = extremes_many(net, slack, along, runs.k, runs.p, runs.q, layout=layout)
        return measure(net, runs), *extremes

    record, end = np.s_[::2, 7, 0], np.s_[::2, 0]
    fine = sizes(batch)
    for spoilt in ({"p": spoiled(batch.p, bad, record)}, {"q": spoiled(batch.q, bad, end)}):
        broken = replace(batch, **spoilt)
        assert broken.failed[::2].all() and not broken.failed[1::2].any()
        for found, known, worst in zip(sizes(broken), fine, (np.inf, -np.inf, np.inf), strict=True):
            part = 0 if "p" in spoilt else 1
            assert not np.isnan(found[part]).any()
            assert (found[part] == worst).any(axis=tuple(range(1, np.ndim(found[part]))))[::2].all()
            assert all(np.array_equal(x[1::2], y[1::2]) for x, y in zip(found, known, strict=True))


@pytest.mark.parametrize("bad", BAD)
def test_a_plan_or_a_scene_that_is_undefined_is_never_safe(bad):
    model, problem = toy_case(40, start=True)
    scene = scene_of(problem, model)
    p0, k = anchored_plans(np.random.default_rng(5), model, CHUNK + 88)
    seen = verdicts(scene, p0, k)
    assert seen.safe.any()
    z = seen.path[:, -1, : model.n_p]
    assert len(screen(scene, z, k).row) > 0
    for axis in range(2):
        moved, turned = (spoiled(x, bad, np.s_[:, axis]) for x in (p0, k))
        assert not verdicts(scene, moved, k).safe.any()
        assert not verdicts(scene, p0, turned).safe.any()
        assert not len(screen(scene, spoiled(z, bad, np.s_[:, axis]), k).row)
        assert not len(screen(scene, z, turned).row)
    obstacles = scene.obstacles
    one = (0, 0, 0)
    broken = [
        scene.replace(slack=np.float64(abs(bad))),
        scene.replace(obstacles=obstacles.replace(vertices=obstacles.vertices * np.nan)),
        scene.replace(goal_b=spoiled(scene.goal_b, np.nan, 0)),
    ]
    for other in broken:
        assert not verdicts(other, p0, k).safe.any()
    # one corner that is none hides nothing of an obstacle that was touched
    holed = obstacles.replace(vertices=spoiled(obstacles.vertices, np.nan, one))
    safe = verdicts(scene.replace(obstacles=holed), p0, k).safe
    assert not (safe & ~seen.safe).any()


@pytest.mark.parametrize("kind", ["plane", "space", "fitted"])
def test_a_path_or_errors_that_are_undefined_keep_no_distance(kind):
    rng = np.random.default_rng(3)
    if kind == "plane":
        model, problem = toy_case(40, start=True)
    else:
        model = points_model(rng, n_p=3 if kind == "space" else 2, fitted=kind == "fitted")
        problem = points_problem(rng, model)
    scene = scene_of(problem, model)
    path = np.full((model.layout.n_steps + 1, model.layout.n_c), 50.0)  # far away
    errors = jax.tree.map(np.asarray, model.tube.during(0))
    near = jax.jit(lambda path, errors: clearance(scene.arrays, path, errors))
    away = jax.jit(Obstacles.away)
    assert near(path, errors) > 0 and (away(scene.obstacles, path, errors) > 0).all()
    for row in (0, len(path) - 1):
        assert not (away(scene.obstacles, spoiled(path, np.nan, row), errors) > 0).any()
        for bad in BAD:
            assert not near(spoiled(path, bad, np.s_[row, -1]), errors) > 0
    wide = errors.replace(half=np.full_like(errors.half, np.inf))
    none = [errors.replace(**{f.name: getattr(errors, f.name) * np.nan}) for f in fields(errors)]
    for wrong in (wide, *none):
        assert not near(path, wrong) > 0


def test_in_turn_as_side_by_side():
    model, problem = toy_case(40, start=True)
    scene = scene_of(problem, model)
    p0, k = anchored_plans(np.random.default_rng(5), model, CHUNK)
    first = int(np.argmax(verdicts(scene, p0, k).safe))
    plan = [p0[first], k[first]]
    bins = jnp.asarray(model.tube.bin_of(k[first][None]).astype(np.int32))
    known = model.net, model.tube, scene.arrays
    judge = jax.jit(lambda p, x: verdict_in_turn(*known, p, x, bins, 1, np.int32(-1))[0])
    assert judge(*plan).safe
    for part, bad in itertools.product(range(2), BAD):
        wrong = list(plan)
        wrong[part] = spoiled(plan[part], bad, -1)
        assert not judge(*wrong).safe


def test_one_corner_that_is_none_is_not_left_out():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    plane = jax.jit(segment.separation)
    hull = jax.jit(lambda a, b, e, v: separation(a, b, ErrorBox(e), v, 0.0))
    for corner in range(4):
        corners = spoiled(square, np.nan, np.s_[corner])
        for x in (-2.0, 3.0):
            a, b = np.array([x, -1.0]), np.array([x, 2.0])
            assert plane(a, b, square, 0.0)[0] > 0 and not plane(a, b, corners, 0.0)[0] > 0
            many = a[None], b[None], np.zeros((1, 2))
            assert hull(*many, square)[0] > 0 and not hull(*many, corners)[0] > 0
    assert not pointwise.row_margin(np.eye(2), np.ones(2), np.array([0.0, np.nan]), 0.0) >= 0
