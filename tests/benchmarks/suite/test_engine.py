"""What entries share: scenes for parc_jax, trees of cells, sets that fresh runs bear out."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.suite.answer import Sets, read
from benchmarks.suite.entries import engine, kit, validated
from benchmarks.suite.instances import instances
from parc_jax.common.sets.hpolytope import HPolytope


def task(one, folder) -> kit.Task:
    (folder / "task.json").write_text(json.dumps(one.task))
    return kit.Task(folder / "task.json")


def test_cells_find_a_corner_that_fails_and_leave_it_out():
    """Plans fail in a fiftieth of the runs of a corner: what is left of the square holds none of
    it, and most of the others.
    """
    rng = np.random.default_rng(0)
    z = rng.uniform(size=(20_000, 2))
    corner = (z[:, 0] < 0.4) & (z[:, 1] > 0.6)
    bad = corner & (rng.uniform(size=len(z)) < 0.02)
    leaves = kit.cells(z, bad, np.zeros(2), np.ones(2), 30, 6.0, 6, wide=2.0)
    kept = np.concatenate([rows for _, _, rows in leaves if bad[rows].mean() < 0.002])
    assert sum(len(rows) for _, _, rows in leaves) == len(z)
    assert corner[kept].mean() < 0.001 and len(kept) > 0.95 * (~corner).sum()
    for lo, hi, rows in leaves:
        assert ((lo <= z[rows]) & (z[rows] <= hi)).all()


def test_sets_along_where_plans_end_hold_what_boxes_of_plans_cannot():
    """Plans whose end p0 + k is in a goal: an oblique slab of the square."""
    rng, lo, hi = np.random.default_rng(0), np.zeros(2), np.ones(2)

    def reaches(z):
        return np.abs(z.sum(axis=1) - 1.0) <= 0.1

    z = rng.uniform(lo, hi, (4000, 2))
    one = SimpleNamespace(n_p=1)
    along = kit.sheared(one, z[:, :1], z[:, 1:], z.sum(axis=1, keepdims=True))
    np.testing.assert_allclose(along, [[1, 1], [0, 1]], atol=1e-9)
    held = {}
    for name, T in (("boxes", None), ("sheared", along)):
        found = kit.boxes(reaches, lo, hi, rng, T, n=20_000)
        pieces = read(json.dumps({"verdict": "some", "polytopes": found}), lo, hi).pieces
        inside = Sets(pieces, rng).holds(z)
        assert reaches(z[inside]).all()
        held[name] = inside.sum() / reaches(z).sum()
    assert held["sheared"] > 0.98 > 0.95 > held["boxes"]


def nested_slabs():
    """What the entry tests, of plans in a unit square: a set that grows upwards as the tube
    falls.
    """
    rows = [
        HPolytope(np.vstack([np.eye(2), -np.eye(2)]), np.array([1.0, top, 0.0, 0.0]))
        for top in np.linspace(0.5, 0.95, len(validated.SCALES))
    ]
    nested = object.__new__(validated.Nested)
    nested.cut, nested.rows = [None], [rows]
    nested.pieces = [engine.piece(engine.spelled(rows[-1], np.array([0.5, 0.4])))]
    return nested


@pytest.mark.parametrize("border", [0.62, 0.3])
def test_the_largest_set_that_runs_bear_out_is_answered_or_none(tmp_path, border):
    """Plans beyond a border fail: it lies between sets, or in the first."""
    (one,) = instances("large", ["puck_01"])
    asked, rng = task(one, tmp_path), np.random.default_rng(0)
    square = SimpleNamespace(start=np.array([[0.0], [1.0]]))
    asked.n_p, asked.k_lo, asked.k_hi = 1, np.zeros(1), np.ones(1)

    def succeed(plans):
        asked.used += len(plans)
        return plans[:, 1] < border

    found, scale = validated.answer(nested_slabs(), square, succeed, asked, rng)
    assert asked.used == asked.budget
    z = Sets(tuple(engine.piece(one) for one in found), rng).draw(20_000)
    assert (z[:, 1] >= border).mean() <= asked.eps and z[:, 1].max() > border - 0.05
    assert abs(np.linspace(0.5, 0.95, len(validated.SCALES))[scale] - border) < 0.05 or scale == 0
    asked.used = 0
    found, _ = validated.answer(
        nested_slabs(), square, lambda z: rng.uniform(size=len(z)) > 0.05, asked, rng
    )
    assert found == []


def test_none_is_said_after_enough_runs_without_success_and_not_before(tmp_path, monkeypatch):
    """So many as show a plan, were there one in two hundred, but with probability delta."""
    spent = []

    def nobody(name, most, failed=0):
        (one,) = instances("large", [name])
        asked, rng = task(one, tmp_path), np.random.default_rng(0)
        asked.budget = most

        def runs(p0, k):
            spent.append(len(k))
            return one.black_box.rollout(p0, k, 0)

        monkeypatch.setattr(asked, "runs", runs)
        return kit.nobody(asked, asked.scene(one.scene_path), rng, failed)

    assert nobody("puck_05", 20_000) and not nobody("puck_01", 20_000)
    (n,) = set(spent)
    assert (1 - 0.99 / 200) ** n <= 0.001 < (1 - 0.99 / 200) ** (n - 1)
    assert not nobody("puck_05", n - 1) and spent == [n, n]
    assert nobody("puck_05", n - 300, failed=300) and spent[2:] == [n - 300]
