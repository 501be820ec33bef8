"""The quick test of many points gives the verdicts of the exact one; a screen that trusts too much
is caught.
"""

import numpy as np
import pytest
from toy_bodies import points_model, points_problem
from toy_models import line_model, toy_case

import sims
from parc_jax.common.sets.box import box
from parc_jax.problem.problem import reach_avoid
from parc_jax.safe_set.corridors import sampling as drawing
from parc_jax.safe_set.corridors.sampling import draw, near
from parc_jax.safe_set.verdict import screen as screening
from parc_jax.safe_set.verdict.pointwise import anchor, verdicts
from parc_jax.safe_set.verdict.scene import scene_of
from parc_jax.safe_set.verdict.screen import CHUNK, screen


def both(model, scene, z, k):
    """Which points are safe: by the screen, and one by one."""
    seen = screen(scene, z, k)
    p0, reaches = anchor(scene, z, k)
    assert seen.reaching == reaches.sum()
    return seen.row, np.flatnonzero(verdicts(scene, p0, k).safe)


def proposals(model, scene, rng, n):
    z = rng.uniform(scene.z_lo, scene.z_hi, (n, model.n_p))
    return z, rng.uniform(scene.k_lo, scene.k_hi, (n, model.n_k))


@pytest.mark.parametrize("seed", [2, 4, 8])
def test_same_verdicts_as_the_exact_test(seed, rng):
    model, problem = toy_case(seed)
    scene = scene_of(problem, model)
    quick, exact = both(model, scene, *proposals(model, scene, rng, 3 * CHUNK + 17))
    assert len(exact) > 100
    np.testing.assert_array_equal(quick, exact)


def test_what_is_in_memory_at_once_is_no_more_than_asked_and_changes_nothing(rng, monkeypatch):
    model, problem = toy_case(4)
    scene = scene_of(problem, model)
    z, k = proposals(model, scene, rng, 3 * CHUNK + 17)
    whole, sizes, one = screen(scene, z, k), [], screening.map_rows

    def counted(size, kernel, row, *rest, **options):
        if len(rest) == 2:  # ends and parameters: of whole plans
            sizes.append(len(row))
        return one(size, kernel, row, *rest, **options)

    monkeypatch.setattr(screening, "AT_ONCE", 100)
    monkeypatch.setattr(screening, "map_rows", counted)
    parts = screen(scene, z, k)
    assert max(sizes) == 100 and sum(sizes) == whole.reaching == parts.reaching > 1000
    for a, b in zip(whole[1:], parts[1:], strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.night
@pytest.mark.parametrize(
    ("n_p", "size", "fitted"), [(2, 0.01, False), (3, 0.03, False), (3, 0.03, True)]
)
def test_same_verdicts_for_bodies_of_several_points(n_p, size, fitted):
    """Contact at a knot is claimed from a few points of the sets of errors: no safe plan is
    lost.
    """
    rng = np.random.default_rng(n_p)
    model = points_model(rng, n_p=n_p, size=size, fitted=fitted)
    scene = scene_of(points_problem(rng, model), model)
    quick, exact = both(model, scene, *proposals(model, scene, rng, 400))
    assert 20 < len(exact) < 380
    np.testing.assert_array_equal(quick, exact)


@pytest.mark.slow
def test_between_fitted_faces_a_table_settles_what_facets_do_not(rng, monkeypatch):
    """Most plans touch where they look worst, which one search per plan tells; of what else no
    facet separates hardly any pair waits for a search, and no safe plan is lost.
    """
    model = sims.model("asv")
    scene = scene_of(sims.asv.problem(), model)
    searched, one = [], screening.map_rows

    def counted(size, kernel, *batch, **options):
        if size == screening.SEARCHED and len(batch) == 5:  # items of pairs
            searched.append(len(batch[0]))
        return one(size, kernel, *batch, **options)

    monkeypatch.setattr(screening, "map_rows", counted)
    z, k = proposals(model, scene, rng, 1000)
    quick, exact = both(model, scene, z, k)
    assert len(exact) > 50 and set(exact) <= set(quick)
    assert sum(searched) < 1.2 * len(k)


@pytest.mark.parametrize("n", [1, CHUNK, CHUNK + 1])
def test_any_number_of_points(n, rng):
    model, problem = toy_case(2)
    scene = scene_of(problem, model)
    np.testing.assert_array_equal(*both(model, scene, *proposals(model, scene, rng, n)))


def test_what_is_safe_comes_back_as_the_network_says(rng):
    model, problem = toy_case(4)
    scene = scene_of(problem, model)
    z, k = proposals(model, scene, rng, 2000)
    seen = screen(scene, z, k)
    e = verdicts(scene, seen.p0, k[seen.row])
    assert e.safe.all()
    np.testing.assert_array_equal(seen.path, e.path)
    np.testing.assert_array_equal(seen.pattern, e.pattern)
    np.testing.assert_array_equal(seen.bin, e.bin)


def test_points_close_by_are_safe_and_close(rng):
    model, problem = toy_case(4)
    scene = scene_of(problem, model)
    seen = draw(scene, rng, 500).safe.at(slice(0, 3))
    found = near(scene, rng, seen, 4000)
    assert len(found.k) > 100 and verdicts(scene, found.p0, found.k).safe.all()
    span = scene.k_hi - scene.k_lo
    distance = (np.abs(found.k[:, None] - seen.k[None]) / span).max(axis=2).min(axis=1)
    assert np.median(distance) < 0.1


def test_no_point_close_by_may_be_inside_of_the_domain(rng, monkeypatch):
    model, problem = toy_case(4)
    scene = scene_of(problem, model)
    seen = draw(scene, rng, 500).safe
    monkeypatch.setattr(drawing, "NEAREST", 1e6)
    monkeypatch.setattr(drawing, "FARTHEST", 1e7)
    assert len(near(scene, rng, seen, 20).k) == 0


@pytest.mark.slow
def test_contact_where_it_does_not_look_worst_is_seen():
    """The end passes a corner, where no facet separates it though nothing is touched; on the way,
    between two knots, it grazes a pole, where the facets look better.
    """
    model = line_model(T=2, half=8.0)
    corner, pole = box([4.4, -2.0], [6.0, -0.4]), box([0.99, 0.45], [1.01, 0.47])
    far = box([20.0, 20.0], [21.0, 21.0])  # so that both scenes are of one compiled shape
    goal = box([3.0, -1.0, -9.0], [5.0, 1.0, 9.0])
    drive = np.array([[4.0, 0.0]])
    for obstacles, safe in (([corner, far], [0]), ([corner, pole], [])):
        scene = scene_of(reach_avoid(goal, obstacles, 0.5), model)
        quick, exact = both(model, scene, drive, drive)
        assert quick.tolist() == exact.tolist() == safe
