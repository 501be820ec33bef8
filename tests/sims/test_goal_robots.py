"""Of each robot of the Goal tasks: its manoeuvres stop, its model is its own, and worlds in step
are driven as each of them alone.
"""

from pathlib import Path

import jax
import numpy as np
import pytest
from needs import need

from parc_jax.learning.runs.law import law_of
from parc_jax.safe_set.verdict.outline import require_same

need("gymnasium")
from in_step import in_step_as_alone  # noqa: E402

from sims.point.together import CLEAR, KITS, Clear  # noqa: E402

each = pytest.mark.parametrize("module", [kit.module for kit in KITS.values()])


@each
def test_its_manoeuvres_come_to_rest(module):
    robot, draw = module.system(1), np.random.default_rng(0)
    k = draw.uniform(robot.domain.lo, robot.domain.hi, (256, 5))
    path = robot.rollout_batch(jax.random.split(jax.random.PRNGKey(0), 256), k, rest=1.0).p
    n = robot.time.n_record
    far = np.linalg.norm(path[:, n:] - path[:, n : n + 1], axis=-1)
    assert far.max() < np.max(module.sensing.REST)


@each
def test_the_model_that_comes_along_is_of_the_system_as_it_is(module):
    robot, model = module.system(), module.model()
    require_same(robot, model)
    assert model.claim.law == law_of(robot) and model.claim.kind == "pac"
    assert Path(module.__file__).with_name("model.npz").stat().st_size < 1_000_000


@pytest.mark.night
def test_worlds_in_step_are_driven_as_each_of_them_alone(monkeypatch):
    in_step_as_alone(
        monkeypatch, "Crax", 3, 50, without=120
    )  # of a Point by a policy: `test_point`


def test_episodes_are_of_worlds_that_begin_clear():
    kit, law = KITS["Crax"], Clear("Crax", 3)
    for seed, other in ((7, False), (8, True), (14, True)):
        world = kit.goal(3).drawn(law(seed))
        assert kit.judge(world.pose[None], world).nearest >= CLEAR
        assert (law(seed) != np.random.default_rng(seed).integers(2**32)) == other
