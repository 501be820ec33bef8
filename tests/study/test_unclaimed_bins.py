"""A bin without a claim: nothing in it is ever safe, and everything else goes on."""

from fractions import Fraction

import jax
import numpy as np
import pytest
from toy_models import model_of

from benchmarks.neuralparc import Published
from parc_jax import checker
from parc_jax.app.plot.regions import safe_regions
from parc_jax.app.study.report import final_error
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import from_box
from parc_jax.common.status import Status
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.bound.counts import NoStatement
from parc_jax.learning.bound.tube import NO_CLAIM
from parc_jax.learning.network.relu import relu_network
from parc_jax.planner import Planner
from parc_jax.problem.problem import reach_avoid
from parc_jax.proof.certificate.write import tube_part
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of


def model(without: int | tuple[int, ...] | None):
    """Straight lines over K = [-1, 1]^2 cut at k_0 = 0, T = 4, tube of 1 cm; bins may have no
    claim.
    """
    W = np.kron(np.arange(1, 5)[:, None] / 4, np.eye(2))
    interval, final = np.full((2, 4, 2), 0.01), np.full((2, 2), 0.01)
    if without is not None:
        interval[[without]], final[[without]] = np.inf, np.inf
    net = relu_network([W], [np.zeros(8)])
    return model_of(net, box([-1, -1], [1, 1]), interval, final, [[-1.0, 0.0, 1.0], [-1.0, 1.0]])


def world():
    return reach_avoid(box([-0.2, -0.2], [0.2, 0.2]), [box([-0.05, 0.3], [0.05, 0.6])], 0.05)


@pytest.mark.night
def test_no_plan_lies_in_a_bin_without_claim_and_the_checker_accepts(tmp_path):
    half, key = model(without=0), jax.random.PRNGKey(0)
    planner = Planner(half)
    answer = planner.solve(world(), key, Settings(samples=20, target=0.1, budget_s=300))
    assert answer.status.found and answer.status is Status.PROVED
    assert (answer.samples[:, 2] > 0).all()
    assert all(polytope.bin == 1 for polytope in answer.polytopes(key, 500))
    assert not answer.contains([[0.3, 0.0]], [[-0.3, 0.0]])[0]
    assert checker.main([str(answer.save(tmp_path / "answer.json"))]) == 0
    assert np.isfinite(answer.scene.slack) and answer.scene.slack < 1e-9
    np.testing.assert_array_equal(final_error(half), [0.01, 0.01])
    assert safe_regions(answer, planner.regions)[0]  # its one region holds safe plans


def test_a_model_without_any_claim_says_so_before_it_looks():
    """Nothing is drawn, no box is divided, nothing is climbed to: the tube decides alone."""
    planner = Planner(model(without=(0, 1)))
    for settings in (Settings.whole(), Settings.fast()):
        answer = planner.solve(world(), jax.random.PRNGKey(0), settings)
        assert answer.status is Status.NOT_FOUND and answer.cover.drawn == 0
        assert answer.absence.leaves == 1 and "that have a claim" in answer.details()
        assert answer.share is None and answer.share_of_k() == 0.0


@pytest.mark.slow
def test_the_same_point_is_safe_once_its_bin_has_a_claim():
    at = np.array([[0.3, 0.0]]), np.array([[-0.3, 0.0]])
    for without, safe in ((None, True), (1, True), (0, False)):
        m = model(without)
        seen = verdicts(scene_of(world(), m), *at)
        assert seen.safe[0] == safe and seen.reaches[0] == safe


def test_certificates_spell_no_infinity_and_a_huge_width_only_grows_obstacles():
    part = tube_part(model(without=1).tube)
    assert (
        float.fromhex(part["interval"][1][0][0][0])
        == NO_CLAIM
        == float.fromhex(part["final"][1][0])
    )
    assert float.fromhex(part["interval"][0][0][0][0]) == 0.01
    assert checker.number(part["final"][1][0]) > 10**99


@pytest.mark.night
def test_the_published_search_skips_it_too():
    aside = world().replace(obstacles=(from_box(box([3.0, 3.0], [4.0, 4.0])),))
    answer = Planner(model(without=0)).solve(
        aside, jax.random.PRNGKey(0), Settings(method=Published(), proof=False)
    )
    assert answer.status.found and (answer.samples[:, 2] >= 0).all()


def test_claims_by_bin_speak_of_dense_laws_only_where_every_bin_has_one():
    half = model(without=None).claim
    every = derived(
        half,
        kind="pac",
        eps=Fraction(1, 50),
        delta=Fraction(1, 1000),
        bin_eps=(Fraction(1, 100), Fraction(1, 50)),
    )
    assert every.risk(density=3.0).bound == Fraction(3, 50)
    some = derived(every, tube=model(without=0).tube, bin_eps=(None, Fraction(1, 50)))
    assert isinstance(some.risk(density=3.0), NoStatement)
