"""Yield: truth by simulation equals what is certified where the model is exact."""

import numpy as np
from synthetic_plants import disturbed, exact, plant, straight_network

from benchmarks.bench import Bench
from benchmarks.cases import Case
from benchmarks.workloads import workload
from parc_jax.claim.declared import declared_claim
from parc_jax.claim.pipeline import BoundSettings
from parc_jax.claim.tube import zero_tube
from parc_jax.model import trajectory_model
from parc_jax.problem import reach_avoid
from parc_jax.sets.box import box

measured = workload("yield")


class Small(Bench):
    """Sizes between a quick look and a measurement."""

    def size(self, full, quick):
        return {1600: 200, 1 << 16: 1 << 12}.get(full, quick)


def scene():
    """A goal of 1 x 1 x 2 and a wall that part of the paths to it cross."""
    return reach_avoid(
        box([0.0, 0.0, -0.5], [1.0, 1.0, 1.5]), [box([0.3, 0.2], [0.4, 0.6])], body=0.05
    )


def toy(run):
    system = plant(run)
    asked = (0, 1.0, 0.05, None, {}, BoundSettings())
    case = Case("toy", lambda: system, scene, ((2,),), (), (1, 1), *asked)
    claim = declared_claim(zero_tube(([0.0, 1.0], [0.0, 1.0]), 4, 2, 3), "the model is exact")
    model = trajectory_model(straight_network(4), claim, system.domain, system.time)
    return case, system, model


def test_where_the_model_is_exact_all_that_succeeds_is_certified():
    case, system, model = toy(exact)
    bench = Small(quick=True)
    truth = measured.truly_safe(case, system, model, bench)
    found = measured.certified(case, model, model.claim, bench)
    assert 0.1 < truth.value < 0.9
    assert truth.bounds[0] <= found.bounds[1] and found.bounds[0] <= truth.bounds[1]


def test_disturbances_that_often_miss_the_goal_leave_less_that_succeeds():
    calm, rough = (
        measured.truly_safe(*toy(run), Small(quick=True)).value for run in (exact, disturbed)
    )
    assert rough < 0.5 * calm


def test_a_tube_wider_than_the_goal_certifies_nothing():
    case, _, model = toy(exact)
    wide = zero_tube(([0.0, 1.0], [0.0, 1.0]), 4, 2, 3).with_halves(
        np.ones((1, 4, 2)), np.ones((1, 3))
    )
    found = measured.certified(case, model, declared_claim(wide, "a guess"), Small(quick=True))
    assert found.count == 0 and found.bounds[0] == 0 < found.bounds[1] < 0.01
