"""Several reference points: their coordinates are columns everywhere behind the boundary, they
travel in files, and work is only continued with the same ones.
"""

import dataclasses
import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from synthetic_plants import noisy, plant
from turning_bar import LENGTH, Bar, Tail

import parc_jax as pj
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.learning.runs.batch import rollout_batch
from parc_jax.learning.runs.collect import collect, simulate_rows
from parc_jax.learning.runs.files import read_npz, save_rollouts, write_npz
from parc_jax.learning.runs.joined import concatenate
from parc_jax.learning.runs.law import identity_of
from parc_jax.learning.runs.loaders import load_rollouts
from parc_jax.learning.runs.simulate import simulator

KEY = jax.random.PRNGKey(0)


@pytest.fixture(scope="module")
def runs():
    return collect(Bar(), KEY, 20, quiet=True)


def named(runs, points):
    return rollout_batch(
        runs.k, runs.p, runs.q, time=runs.time, domain=runs.domain, law=runs.law, points=points
    )


@pytest.mark.slow
def test_columns_are_the_points_one_by_one(runs):
    _, (p, _) = simulate_rows(Bar(), KEY, Stage.TRAIN, np.arange(20))
    drawn = simulator(Bar()).rows(KEY, Stage.TRAIN, np.arange(20))
    by_hand = np.asarray(jax.vmap(Bar().rollout)(drawn.keys, jnp.asarray(drawn.k)).p)
    assert by_hand.shape == (20, 9, 2, 2)
    np.testing.assert_allclose(runs.p[:, :, 0:2], by_hand[:, :, 0], rtol=0, atol=1e-6)
    np.testing.assert_allclose(runs.p[:, :, 2:4], by_hand[:, :, 1], rtol=0, atol=1e-6)
    np.testing.assert_array_equal(np.asarray(p), runs.p)
    assert (runs.n_p, runs.n_c, runs.points) == (2, 4, ("tail", "nose"))
    apart = np.linalg.norm(runs.p[..., 2:] - runs.p[..., :2], axis=-1)
    np.testing.assert_allclose(apart, LENGTH, rtol=1e-12)


def test_the_first_point_is_what_a_system_of_one_point_returns(runs):
    alone = collect(Tail(), KEY, 20, quiet=True)
    np.testing.assert_array_equal(alone.p, runs.p[:, :, :2])
    assert (alone.n_p, alone.n_c) == (2, 2)


def test_only_the_first_point_starts_at_the_origin(runs):
    assert (runs.p[:, 0, :2] == 0).all() and (runs.p[:, 0, 3] == LENGTH).all()
    moved = dataclasses.replace(runs, p=runs.p + 1.0)
    with pytest.raises(InputError, match="Subtract the start of tail from all points"):
        named(moved, runs.points)


def test_a_rollout_without_all_points_is_refused():
    class Half(Bar):
        def rollout(self, key, k):
            p, q = super().rollout(key, k)
            return pj.Trajectory(p[:, 0], q)

    with pytest.raises(InputError, match=r"\(9, 2, 2\).*got p \(9, 2\).*of all reference points"):
        collect(Half(), KEY, 4, quiet=True)


@pytest.mark.parametrize("names", [(), ("a", "a"), "ab", ("a", 1), ("a", "")])
def test_points_are_distinct_names(runs, names):
    class Named(Bar):
        points = names

    with pytest.raises(InputError, match="tuple of distinct names"):
        collect(Named(), KEY, 4, quiet=True)
    with pytest.raises(InputError, match="tuple of distinct names"):
        named(runs, names)


def test_a_file_keeps_the_points_and_an_old_one_has_one(runs, tmp_path):
    again = load_rollouts(save_rollouts(tmp_path / "runs.npz", runs))
    assert again.points == runs.points and again.n_p == 2
    np.testing.assert_array_equal(again.p, runs.p)
    arrays = read_npz(
        save_rollouts(tmp_path / "old.npz", collect(plant(noisy), KEY, 5, quiet=True))
    )
    meta = json.loads(str(arrays["meta"]))
    del meta["points"], meta["digest"]  # as written before there were points
    write_npz(tmp_path / "old.npz", arrays | {"meta": np.array(json.dumps(meta))})
    assert load_rollouts(tmp_path / "old.npz").points == ("reference",)


def test_other_points_are_other_work(runs, tmp_path):
    class Renamed(Bar):
        points = ("tail", "tip")

    assert identity_of(Renamed())["points"] != identity_of(Bar())["points"]
    path = tmp_path / "runs.npz"
    collect(Bar(), KEY, 20, path=path, quiet=True)
    with pytest.raises(InputError, match=r"expected the same .*points"):
        collect(Renamed(), KEY, 20, path=path, quiet=True)
    with pytest.raises(InputError, match=r"they differ in points .*nose.*tip"):
        concatenate([runs, dataclasses.replace(runs, points=("tail", "tip"))])


def test_an_array_of_points_and_a_table_of_columns_are_the_same_log(runs, tmp_path):
    start = np.array([3.0, -1.0])
    by_point = runs.p.reshape(20, 9, 2, 2) + start
    np.savez(tmp_path / "log.npz", k=runs.k, p=by_point, q=runs.q, points=["tail", "nose"])
    np.savez(tmp_path / "flat.npz", k=runs.k, p=by_point.reshape(20, 9, 4), q=runs.q)
    logged = load_rollouts(tmp_path / "log.npz", Bar.time, Bar.domain)
    flat = load_rollouts(tmp_path / "flat.npz", Bar.time, Bar.domain, points=("tail", "nose"))
    for batch in (logged, flat):
        np.testing.assert_allclose(batch.p, runs.p, rtol=0, atol=1e-14)
        assert batch.points == ("tail", "nose")


def test_logs_whose_points_do_not_fit_are_refused(runs, tmp_path):
    np.savez(tmp_path / "log.npz", k=runs.k, p=runs.p.reshape(20, 9, 2, 2), q=runs.q)
    with pytest.raises(InputError, match="names of the 2 reference points"):
        load_rollouts(tmp_path / "log.npz", Bar.time, Bar.domain)
    with pytest.raises(InputError, match=r"3 reference points \(a, b, c\)"):
        load_rollouts(tmp_path / "log.npz", Bar.time, Bar.domain, points=("a", "b", "c"))
    save_rollouts(tmp_path / "own.npz", runs)
    with pytest.raises(InputError, match="knows its own"):
        load_rollouts(tmp_path / "own.npz", points=("nose", "tail"))
    assert load_rollouts(tmp_path / "own.npz", points=["tail", "nose"]).points == runs.points


def stick(rng, k):
    """Two points of plain Python, seen from somewhere."""
    s = np.linspace(0.0, 1.0, 9)[:, None]
    tail = np.array([2.0, 5.0]) + s * k + 0.01 * s * rng.normal(size=2)
    return np.stack([tail, tail + np.array([0.0, LENGTH])], axis=1), []


def test_plain_python_may_return_several_points():
    robot = pj.python_system(
        stick, Bar.domain, Bar.time, name="stick", n_p=2, points=("tail", "nose"), workers=0
    )
    runs = collect(robot, KEY, 5, quiet=True)
    assert runs.p.shape == (5, 9, 4) and (runs.p[:, 0, :2] == 0).all()
    apart = runs.p[..., 2:] - runs.p[..., :2] - np.array([0.0, LENGTH])
    np.testing.assert_allclose(apart, 0.0, atol=1e-14)
    one = pj.python_system(stick, Bar.domain, Bar.time, name="stick", n_p=2, workers=0)
    with pytest.raises(InputError, match=r"expected p \(9, 2\).*got \(9, 2, 2\)"):
        collect(one, KEY, 5, quiet=True)


@pytest.mark.slow
def test_the_start_is_tried_for_all_points():
    starts = np.array([[3.0, 0.0], [0.0, -40.0]])
    assert pj.learning.translation_gap(Bar(), KEY, starts).p.max() < 1e-12

    class Pulled(Bar):
        def rollout_from(self, key, k, p0):
            p, q = super().rollout_from(key, k, p0)
            return pj.Trajectory(p.at[:, 1].add(0.1 * jnp.sin(p0)), q)

    assert pj.learning.translation_gap(Pulled(), KEY, starts).p.max() > 0.01
