"""Contact between bodies and obstacles, against other programs; scenes as parc_jax reads them."""

import itertools

import numpy as np
import pytest
from needs import need
from scipy.optimize import linprog

from benchmarks.suite.bad import Refused
from benchmarks.suite.boxes import load
from benchmarks.suite.contact import block, gap, hull, touched
from benchmarks.suite.instances import instances
from benchmarks.suite.scene import load_scene
from parc_jax.problem.problem_file import load_problem


@pytest.mark.parametrize("radius", [0.0, 0.3])
def test_polygons_touch_where_another_program_says_so(radius):
    need("shapely")
    from shapely import MultiPoint, Polygon

    rng = np.random.default_rng(0)
    for points in (1, 2, 4):
        for _ in range(60):
            corners = np.array(MultiPoint(rng.normal(size=(6, 2))).convex_hull.exterior.coords)[:-1]
            poses = rng.normal(size=(5, points, 2)) * rng.uniform(0.1, 1) + rng.normal(size=2) * 2
            far = [MultiPoint(pose).convex_hull.distance(Polygon(corners)) for pose in poses]
            found = gap(poses, hull(corners), radius)
            apart = np.array(far) > radius + 1e-9
            assert ((found > radius) == apart).all()
            if radius > 0:
                assert np.abs(found - far)[np.array(far) > 1e-9].max(initial=0.0) < 1e-9


def test_boxes_in_space_touch_where_a_linear_program_finds_a_common_point():
    rng = np.random.default_rng(1)
    signs = np.array(list(itertools.product((1, -1), repeat=3)))
    obstacle = block(np.array([[0.0, 0, 0], [1, 0.5, 0.3]]))
    for _ in range(60):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        corners = (signs * rng.uniform(0.1, 0.6, 3)) @ turn + rng.uniform(-0.7, 1.5, 3)
        sum_to_one = np.concatenate([corners.T, np.ones((1, 8))])
        box = np.concatenate([corners.T, -corners.T])
        rows = np.concatenate([obstacle.around[1], -obstacle.around[0]])
        common = linprog(np.zeros(8), box, rows, sum_to_one[3:], [1.0], method="highs").status == 0
        assert (gap(corners[None], obstacle)[0] <= 0) == common


def test_a_touch_at_any_record_counts():
    p = np.linspace([0.0, 0.0], [1.0, 0.0], 11)[None, :, None] * np.ones((3, 1, 1, 1))
    p[1, :, 0, 1], p[2, 5, 0, 0] = 0.31, np.nan
    wall = block(np.array([[0.48, -0.2], [0.52, 0.2]]))
    assert touched(p, wall, 0.1).tolist()[:2] == [True, False]
    assert not touched(p[:1] + 5.0, wall, 0.1).any()


OF_TOYS = instances("large", ("puck", "bar"))


@pytest.mark.parametrize("one", OF_TOYS, ids=lambda one: one.id)
def test_parc_jax_reads_the_same_scene(one):
    points = one.black_box.points
    problem = load_problem(one.scene_path, points)
    assert len(problem.obstacles) == len(one.scene.obstacles)
    rng = np.random.default_rng(0)
    p = rng.uniform(-1, 3, (500, 1, len(points), 2))
    q = rng.uniform(-0.5, 2, (500, len(one.black_box.q)))
    ends = np.concatenate([p.reshape(500, -1), q], axis=1)
    ends = ends[:, : problem.goal.n]
    inside = (ends @ np.asarray(problem.goal.A).T <= np.asarray(problem.goal.b)).all(axis=1)
    alone = type(one.scene)(one.scene.start, one.scene.ends, one.scene.q, one.scene.body, ())
    assert (alone.succeeds(p, q) == inside).all()
    for ours, theirs in zip(one.scene.obstacles, problem.obstacles, strict=True):
        assert (ours.vertices @ np.asarray(theirs.A).T <= np.asarray(theirs.b) + 1e-9).all()


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("[start]\nlo = [0, 0]\nhi = [1]", "goal"),
        ("[goal]\nlo = [0, 0]\nhi = [1, 1]\n[body]\nradius = 0.1", "start"),
        ("[start]\nlo=[0,0]\nhi=[1,1]\n[goal]\nlo=[0]\nhi=[1]\n[body]\nradius=0.1", "2 numbers"),
        ("no", "TOML"),
    ],
)
def test_a_scene_without_sense_is_refused_in_a_sentence(text, word, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(Refused, match=word):
        load_scene(path, ("reference",), 2, 0)


@pytest.mark.parametrize("name", sorted({one.box for one in OF_TOYS}))
def test_a_toy_repeats_itself_and_begins_at_its_start(name):
    box, rng = load(name), np.random.default_rng(0)
    p0, k = rng.normal(size=(50, 2)), rng.uniform(box.k_lo, box.k_hi, (50, 2))
    (p, q), (again, _), (other, _) = (box.rollout(p0, k, seed) for seed in (1, 1, 2))
    assert p.shape == (50, box.records * box.fine + 1, len(box.points), 2)
    assert q.shape == (50, len(box.q)) and (p == again).all()
    assert (p[:, 0, 0] == p0).all()
    assert (p == other).all() == ("calm" in name)
    if box.speed is not None:
        assert np.abs(np.diff(p, axis=1)).max() <= box.speed * box.dt / box.fine
