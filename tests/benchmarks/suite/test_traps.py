"""Traps catch who ignores them, and nobody else."""

from types import SimpleNamespace

import numpy as np
import pytest
from suite_cases import robust, text

from benchmarks.suite.boxes import puck
from benchmarks.suite.entries import by_tube
from benchmarks.suite.instances import instances
from benchmarks.suite.score import score


def of(name):
    (one,) = instances("large", [name])
    return one


@pytest.mark.slow
def test_the_hidden_caster_is_hardly_seen_and_refutes_who_ignores_it():
    one = of("puck_07")
    lo, hi = np.array(puck.K)
    corner = (puck.GENTLE - lo[0]) * (hi[1] - puck.LEFT) / np.prod(hi - lo)
    assert 300 * corner * puck.SWINGS < 0.15  # in as many runs
    p, _ = one.black_box.rollout(np.zeros((100_000, 2)), np.tile([1.2, 0.9], (100_000, 1)), 0)
    assert abs((p[:, -1, 0, 1] > 1.1).mean() - puck.SWINGS) < 0.003
    goal = np.stack([one.scene.ends[0, 0], one.scene.ends[1, 0]])
    ignores = robust(goal)
    harder = ignores | {"lo": [*ignores["lo"][:2], puck.GENTLE, ignores["lo"][3]]}
    farther = ignores | {"hi": [*ignores["hi"][:3], puck.LEFT]}
    answers = {"ignores": text(polytopes=[ignores]), "heeds": text(polytopes=[harder, farther])}
    found = score(one, answers, "0")
    assert found["entries"]["ignores"]["status"] == "refuted"
    assert found["entries"]["heeds"]["status"] == "stands"
    assert found["entries"]["heeds"]["yield"][0] > 0.8 and found["truth"]["good"] > 100


def test_the_post_between_records_refutes_who_sees_records_alone_and_can_be_passed():
    one, rng = of("puck_08"), np.random.default_rng(0)
    plans = rng.uniform(*one.bounds, (20_000, 4))
    runs = one.black_box.rollout(plans[:, :2], plans[:, 2:], 1)
    assert np.abs(np.diff(runs[0], axis=1)).max() <= one.black_box.speed * puck.DT
    seen = runs[0][:, :: one.black_box.fine]
    careful = by_tube.between_records(one.scene, SimpleNamespace(told=one.task, n_p=2))
    good = {"seen": one.scene.succeeds(seen, runs[1]), "proved": careful.succeeds(seen, runs[1])}
    assert good["proved"].mean() > 0.02 and not (good["proved"] & ~good["seen"]).any()
    assert not (good["proved"] & ~one.scene.succeeds(*runs)).any()  # whatever is seen
    calm = {name: _calm(plans[some]) for name, some in good.items()}
    found = score(one, {name: text(plans=some.tolist()) for name, some in calm.items()}, "0")
    assert found["entries"]["seen"]["status"] == "refuted"
    assert found["entries"]["proved"]["status"] == "stands"


def _calm(plans):
    """Those that no gust throws out of the goal."""
    ends = plans[:, :2] + puck.pushed(plans[:, 2:])
    goal = np.array([[1.5, -0.5], [2.5, 0.5]]) + 2 * puck.GUST * np.array([[1], [-1]])
    return plans[((goal[0] <= ends) & (ends <= goal[1])).all(axis=1)]
