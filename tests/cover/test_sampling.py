"""Draws of the goal-reaching set: uniform, volume preserving, decided by the key; cells name region
and bin.
"""

import jax
import numpy as np
import pytest
from scipy.stats import kstest
from toy_models import line_model, told, toy_case

from parc_jax.common.keys import generator
from parc_jax.common.sets.box import box
from parc_jax.learning.bound.tube import tube
from parc_jax.problem.problem import reach_avoid
from parc_jax.safe_set.corridors.polytopes import cell_of, groups
from parc_jax.safe_set.corridors.sampling import (
    draw,
    ends_of,
    points,
)
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of


@pytest.mark.slow
def test_draws_are_uniform_over_k_and_the_goals_box(rng):
    model = line_model(4, 0.0)
    goal = box([-0.5, 1, -9], [0.5, 2, 9])
    seen = draw(scene_of(reach_avoid(goal, [], 0.1), model), rng, 4000)
    assert seen.drawn == 4000 and seen.reaching == len(seen.safe.k) == 4000
    end = seen.safe.path[:, -1]
    for x, lo, hi in ((seen.safe.k, [-1, -1], [1, 1]), (end, goal.lo[:2], goal.hi[:2])):
        for axis in range(2):
            assert kstest(x[:, axis], "uniform", (lo[axis], hi[axis] - lo[axis])).pvalue > 1e-4
    assert (
        np.abs(np.corrcoef(np.concatenate([seen.safe.k, end], axis=1).T) - np.eye(4)).max() < 0.08
    )


@pytest.mark.parametrize(
    ("lo", "hi"), [((0.5, -1), (1, 1)), ((0.5, 0.75), (1, 1)), ((-1, -1), (-0.5, 0.5))]
)
def test_a_part_of_k_has_no_plan_in_bins_beside_it(lo, hi):
    """Of two axes with a bin below each, volumes below nothing made one: its k were beside."""
    model, half = line_model(4, 0.0), np.array([-1.0, 0.0, 1.0])
    own = model.tube
    wide, final = (np.repeat(x, 4, axis=0) for x in (own.interval, own.final))
    model = told(model, tube=tube([half, half], wide, final, 1))
    scene = scene_of(reach_avoid(box([-0.5, 1, -9], [0.5, 2, 9]), [], 0.1), model)
    scene = scene.replace(k_lo=np.array(lo, float), k_hi=np.array(hi, float))
    ends = ends_of(scene)
    assert (ends.volume >= 0).all()
    assert ends.volume.sum() == pytest.approx(np.prod(np.subtract(hi, lo)))
    some = ends.volume > 0
    assert (ends.k_lo[some] >= lo).all() and (ends.k_hi[some] <= hi).all()


@pytest.mark.slow
def test_counts_are_of_what_reaches_and_what_is_safe(rng):
    model, problem = toy_case(8)
    scene = scene_of(problem, model)
    seen = draw(scene, rng, 2000)
    assert seen.drawn == 2000 >= seen.reaching >= len(seen.safe.k) > 0
    e = verdicts(scene, seen.safe.p0, seen.safe.k)
    assert e.safe.all()
    np.testing.assert_array_equal(e.path, seen.safe.path)
    again = points(seen.safe.p0, seen.safe.k, e)  # whoever names them, one program serves
    assert [x.dtype for x in again] == [x.dtype for x in seen.safe]


def test_cells_are_equal_exactly_when_pattern_and_bin_are(rng):
    pattern, number = rng.integers(0, 2, (300, 5)).astype(bool), rng.integers(0, 3, 300)
    cells = cell_of(pattern, number)
    for i, j in rng.integers(0, 300, (500, 2)):
        same = (pattern[i] == pattern[j]).all() and number[i] == number[j]
        assert (cells[i] == cells[j]) == same
    parts = groups(cells)
    assert sorted(np.concatenate([index for _, index in parts]).tolist()) == list(range(300))
    assert (
        len({key for key, _ in parts})
        == len(parts)
        == len(set(map(tuple, np.column_stack([pattern, number]))))
    )
    assert groups(cells[:0]) == []


@pytest.mark.parametrize("width", [0, 1, 8, 9, 200])
def test_patterns_of_any_width_have_cells(width, rng):
    pattern = rng.integers(0, 2, (20, width)).astype(bool)
    assert len(groups(cell_of(pattern, np.zeros(20, int)))) == len(np.unique(pattern, axis=0))
    assert len(groups(cell_of(pattern, np.arange(20)))) == 20


def test_all_bits_of_a_key_count_and_both_kinds_of_keys_work():
    draws = {}
    for name, key in {
        "new": jax.random.key(7),
        "old": jax.random.PRNGKey(7),
        "other": jax.random.key(8),
        "high bits": jax.random.wrap_key_data(np.array([1, 7], np.uint32)),
    }.items():
        draws[name] = generator(key).random()
    assert draws["new"] == draws["old"] and len(set(draws.values())) == 3
