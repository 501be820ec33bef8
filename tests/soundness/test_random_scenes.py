"""Random scenes and networks: what the pointwise test accepts, a dense oracle finds free of
contact; what the oracle finds clearly free, the test accepts. Broken engines are shown to be caught
by the same comparison.
"""

from typing import NamedTuple

import jax
import numpy as np
import pytest
from dense_oracle import DEPTH, knots_of, row_room, smallest_distance
from toy_models import anchored_plans, random_model, random_problem

from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import from_box, hpolytope
from parc_jax.problem.problem import Problem
from parc_jax.safe_set.verdict import pointwise as engine
from parc_jax.safe_set.verdict.pointwise import verdicts as verdicts_of
from parc_jax.safe_set.verdict.scene import scene_of

pytestmark = pytest.mark.soundness

NETS, T, HIDDEN, BINS, CORNERS = 50, 3, (5, 4), (1, 2), 32  # one compiled shape
BODIES = ("disc", "disc", "polygon")
TRIES = 6  # plans drawn for each network


class Case(NamedTuple):
    """One scene met by many networks, one plan each: nets, tubes stacked; scene; p0, k (NETS,
    2).
    """

    models: list
    problem: Problem
    scene: object
    p0: np.ndarray
    k: np.ndarray


class Truth(NamedTuple):
    """What the oracle says (NETS,): smallest distance, what it may miss between samples, room of
    goal and start.
    """

    gap: np.ndarray
    blind: np.ndarray
    room: np.ndarray


@pytest.fixture(scope="module")
def models():
    rng = np.random.default_rng(0)
    return [
        random_model(rng, T, HIDDEN, BINS, size=rng.choice([0.01, 0.05, 0.15])) for _ in range(NETS)
    ]


def random_case(models, seed: int) -> Case:
    rng = np.random.default_rng([1, seed])
    order = rng.permutation(len(models))
    models = [models[i] for i in order]
    problem = random_problem(rng, models[0], 2, BODIES[seed % 3], start=seed % 4 == 0)
    span = (None, (0, T - 1), (0, 0), (1, T - 1))[seed % 4]
    goal = box([-0.5, -0.5, -5.0], [0.5, 0.5, 5.0])
    problem = problem.replace(goal=goal_rows(goal, rng), spans=(span, None))
    plans = nearest_calls(problem, models, [anchored_plans(rng, model, TRIES) for model in models])
    return Case(models, problem, scene_of(problem, models[0]).arrays, *plans)


def nearest_calls(problem, models, drawn):
    """Of the plans (p0, k) drawn for each network the one whose distance to the obstacles is
    nearest to zero, the hardest to judge: p0, k (NETS, 2).
    """
    knots, widths = [], []
    for model, (p0, k) in zip(models, drawn, strict=True):
        knots.append(knots_of(model.net, T, p0, k)[0])
        widths.append(model.tube.interval[model.tube.bin_of(k)])
    gap, _ = smallest_distance(problem, np.concatenate(knots), np.concatenate(widths), n_points=7)
    best = np.abs(gap).reshape(-1, TRIES).argmin(axis=1)
    p0, k = (np.array(x) for x in zip(*drawn, strict=True))
    return p0[np.arange(len(best)), best], k[np.arange(len(best)), best]


def goal_rows(goal, rng):
    """The box cut by one slanted row, in units of its own."""
    rows = from_box(goal)
    cut = rng.normal(size=3) * rng.uniform(0.1, 10)
    return hpolytope(
        np.concatenate([rows.A, cut[None]]), np.append(rows.b, 0.6 * np.abs(cut[:2]).sum())
    )


def stacked(case: Case):
    nets, tubes = ([getattr(m, name) for m in case.models] for name in ("net", "tube"))
    over = lambda parts: jax.tree.map(lambda *xs: np.stack(xs), *parts)  # noqa: E731
    lowered = case.scene.obstacles
    pad = ((0, 0), (0, CORNERS - lowered.vertices.shape[1]), (0, 0))  # one compiled shape
    lowered = lowered.replace(
        vertices=np.pad(lowered.vertices, pad, "edge"), signs=np.pad(lowered.signs, pad, "edge")
    )
    return (
        over(nets),
        over(tubes),
        case.scene.replace(obstacles=lowered),
        case.p0,
        case.k,
    )


verdicts = jax.vmap(
    engine.verdict, in_axes=(0, 0, None, 0, 0)
)  # not compiled as a whole: faults are patched in
compiled = jax.jit(verdicts)  # traced before any fault


def truth(case: Case) -> Truth:
    knots, q, errors, finals = [], [], [], []
    for model, p0, k in zip(case.models, case.p0, case.k, strict=True):
        path, further = knots_of(model.net, T, p0[None], k[None])
        number = int(model.tube.bin_of(k))
        knots.append(path[0]), q.append(further[0])
        errors.append(model.tube.interval[number]), finals.append(model.tube.final[number])
    knots, q, errors, finals = (np.array(x) for x in (knots, q, errors, finals))
    return Truth(
        *smallest_distance(case.problem, knots, errors), row_room(case.problem, knots, q, finals)
    )


def known(models, seed, cache={}):  # noqa: B006  (kept on purpose: the faults share their cases)
    if seed >= 100:
        case = random_case(models, seed)
        return case, truth(case)
    if seed not in cache:
        cache[seed] = random_case(models, seed)
        cache[seed] = cache[seed], truth(cache[seed])
    return cache[seed]


def compare(models, seeds, verdicts):
    """Counts over all pairs: accepted, accepted although the oracle objects, refused although
    clearly safe.
    """
    accepted = wrong = missed = pairs = clear = 0
    for seed in seeds:
        case, real = known(models, seed)
        got = np.asarray(verdicts(*stacked(case)).safe)
        accepted, pairs = accepted + int(got.sum()), pairs + len(got)
        wrong += int((got & ((real.gap < -DEPTH) | (real.room < -DEPTH))).sum())
        surely = (real.gap - real.blind > DEPTH) & (real.room > DEPTH)
        clear, missed = clear + int(surely.sum()), missed + int((surely & ~got).sum())
    return accepted, wrong, missed, pairs, clear


def test_accepted_plans_are_free_and_clearly_free_plans_are_accepted(models):
    accepted, wrong, missed, pairs, clear = compare(models, range(20), compiled)
    assert wrong == 0 and missed == 0
    assert 0.1 * pairs < accepted < 0.7 * pairs and clear > 0.95 * accepted, (
        accepted,
        pairs,
        clear,
    )


@pytest.mark.night
@pytest.mark.timeout(1200)
def test_a_hundred_thousand_scenes_and_networks(models):
    accepted, wrong, missed, pairs, clear = compare(models, range(1000, 3000), compiled)
    assert pairs == 100_000
    assert wrong == 0 and missed == 0
    assert 0.1 * pairs < accepted < 0.7 * pairs and clear > 0.95 * accepted


@pytest.mark.slow
def test_the_batched_entry_agrees_with_the_kernel(models):
    case = random_case(models, 5)
    expected = compiled(*stacked(case))
    for i in (7, 23):
        model = case.models[i]
        got = verdicts_of(scene_of(case.problem, model), case.p0[[i]], case.k[[i]])
        np.testing.assert_allclose(got.clearance[0], expected.clearance[i], atol=1e-12)
        np.testing.assert_allclose(got.path[0], expected.path[i], atol=1e-12)
        assert (
            int(got.bin[0]) == int(expected.bin[i])
            and (got.pattern[0] == expected.pattern[i]).all()
        )
