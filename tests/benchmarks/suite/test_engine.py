"""What the entries by parc_jax share: scenes for it, and looks at fresh runs of answers."""

import json

import numpy as np
import pytest

from benchmarks.suite.entries import engine, kit
from benchmarks.suite.instances import instances


def task(one, folder) -> kit.Task:
    (folder / "task.json").write_text(json.dumps(one.task))
    return kit.Task(folder / "task.json")


@pytest.mark.parametrize("name", ["bar_01", "bar_02", "puck_02"])
def test_a_goal_bounds_every_state_that_a_model_has(name, tmp_path):
    """Also where the scene file asks nothing of the heading."""
    (one,) = instances("large", [name])
    goal = engine.scene(task(one, tmp_path), one.scene_path).goal
    box = one.black_box
    bounded = (goal.A > 0).any(axis=0) & (goal.A < 0).any(axis=0)
    ends = len(box.points) * box.n_p
    assert goal.n == ends + len(box.q) and bounded[: box.n_p].all() and bounded[ends:].all()


def sets(*sides):
    """Boxes of plans [0, 1] x side, as polytopes are spelled."""
    rows = {"A": [[1, 0]], "b": [1]}
    return [rows | {"lo": [0, lo], "hi": [1, hi]} for lo, hi in sides]


def test_what_fails_afresh_is_left_out_until_a_look_sees_no_failure(tmp_path):
    (one,) = instances("large", ["puck_01"])
    asked, rng, seen = task(one, tmp_path), np.random.default_rng(0), []

    def succeed(plans):
        seen.append(len(plans))
        return plans[:, 1] < 1.9

    good, bad = sets((0, 1), (1.2, 1.8)), sets((1.5, 2.0))
    assert engine.borne_out(good + bad, succeed, asked, rng) == good
    times, n = engine.looks(asked)
    assert seen == [n] * 2 and (1 - asked.eps) ** n <= asked.delta / times
    assert engine.borne_out(bad, succeed, asked, rng) == []
    assert engine.borne_out([], succeed, asked, rng) == []
    seen.clear()
    never = engine.borne_out(good, lambda plans: seen.append(0) or plans[:, 0] > 0.5, asked, rng)
    assert never == [] and len(seen) <= times


def test_looks_leave_runs_to_learn_from(tmp_path):
    for one in instances("large", ("puck", "bar")):
        times, n = engine.looks(task(one, tmp_path))
        assert times >= 1 and times * n <= 0.5 * one.budget


def test_what_a_model_leaves_is_enough_to_say_none_where_it_can_be_spared(tmp_path):
    for name, spared in (
        ("puck_05", True),
        ("asv_09", True),
        ("drone_09", True),
        ("f110_09", False),
    ):
        (one,) = instances("large", [name])
        asked = task(one, tmp_path)
        assert (kit.enough(asked) <= engine.reserve(asked)) is spared
        assert engine.reserve(asked) <= one.budget // 3


def test_none_is_said_after_enough_runs_without_success_and_not_before(tmp_path, monkeypatch):
    """So many as show a plan, were there one in two hundred, but with probability delta."""
    spent = []

    def nobody(name, most):
        (one,) = instances("large", [name])
        asked, rng = task(one, tmp_path), np.random.default_rng(0)

        def runs(p0, k):
            spent.append(len(k))
            return one.black_box.rollout(p0, k, 0)

        monkeypatch.setattr(asked, "runs", runs)
        return kit.nobody(asked, asked.scene(one.scene_path), rng, most)

    assert nobody("puck_05", 20_000) and not nobody("puck_01", 20_000)
    (n,) = set(spent)
    assert (1 - 0.99 / 200) ** n <= 0.001 < (1 - 0.99 / 200) ** (n - 1)
    assert not nobody("puck_05", n - 1) and spent == [n, n]
