"""Plans of a narrow scene, found through wider ones; and the scene with its cars moved together."""

import jax
import numpy as np
import pytest
from gap_model import HI, LO, arc_network, arc_tube, gap_problem
from toy_models import model_of

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.common.status import Status
from parc_jax.planner.planner import Planner
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of
from sims.drift_parking.closing_in import ClosingIn, narrowest
from sims.drift_parking.scenario import APART, PARKED_CARS, problem

T = 6


@pytest.fixture(scope="module")
def model():
    t = arc_tube(T, size=0.005)
    return model_of(arc_network(T), box(LO, HI), t.interval, t.final, t.edges)


@pytest.mark.slow
def test_the_gap_is_closed_until_no_plan_is_found(model):
    at, seen = narrowest(model, gap_problem, 1.6, 0.1, np.random.default_rng(0))
    assert 0.6 < at < 1.6 and len(seen.k)  # the disc alone is 0.6 m across
    assert verdicts(scene_of(gap_problem(at), model), seen.p0, seen.k).safe.all()
    _, none = narrowest(model, gap_problem, 0.6, 0.1, np.random.default_rng(0))
    assert len(none.k) == 0


@pytest.mark.night
def test_a_narrow_scene_is_answered_through_wider_ones_and_proved(model):
    method = ClosingIn((gap_problem(1.6), gap_problem(1.3)))
    settings = Settings(method=method, samples=5)
    answer = Planner(model).solve(gap_problem(1.1), jax.random.key(0), settings)
    assert len(answer.samples) == 5 and answer.status is Status.PROVED
    assert answer.share is None
    assert answer.corridors and answer.coverage.at_least == 0
    many = answer.sample(jax.random.key(1), 200)
    assert verdicts(answer.scene, many[:, :2], many[:, 2:]).safe.all()
    nothing = Planner(model).solve(gap_problem(0.6), jax.random.key(0), settings)
    assert len(nothing.samples) == 0 and not nothing.corridors


def test_cars_are_moved_together_about_the_middle_of_their_gap():
    for apart in (APART, 4.6):
        left, right = problem("rectangle", apart).obstacles
        assert -right.b[2] - left.b[0] == pytest.approx(apart, abs=1e-12)
        assert -right.b[2] + left.b[0] == pytest.approx(PARKED_CARS[0][1][0] + PARKED_CARS[1][0][0])
        for car in (left, right):
            assert car.b[0] + car.b[2] == pytest.approx(4.267)
    for wrong in (0.0, -1.0, float("nan")):
        with pytest.raises(InputError, match="apart: expected metres > 0"):
            problem("disc", wrong)
