"""What an answer says of plans drawn from it, against an answer whose true values are known."""

from dataclasses import replace
from fractions import Fraction

import jax
import numpy as np
import pytest
from scipy.stats import binom
from toy_models import line_model, toy_case
from toy_whole import answer

import parc_jax as pj
from parc_jax.answer.risk import density_of_k
from parc_jax.learning.bound.claim import derived
from parc_jax.problem.robust.realisations import Robustness
from parc_jax.safe_set.corridors.sampling import Place, ends_from
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.statement import IN_THE_BOX, set_of
from sims.boxes_of_k import under

KEY = jax.random.PRNGKey(0)
SAMPLES = pj.Settings(samples=600, work=1e-3, samples_only=True, proof=False)
OPEN = pj.box([-0.5, -0.5, -9], [0.5, 0.5, 9])  # a goal whose box is the square of side 1
SLANTED = pj.hpolytope(
    [[1, 1, 0], [-1, -1, 0], [1, -1, 0], [-1, 1, 0], [0, 0, 1], [0, 0, -1]], [0.5] * 4 + [9] * 2
)  # half of that square


def covering(at_least):
    """The answer, with corridors that are only shown to cover this share of the safe set."""
    coverage = answer().coverage._replace(share=at_least, at_least=at_least)
    return replace(answer(), cover=answer().cover._replace(coverage=coverage))


def test_the_density_of_a_whole_answer_is_close_to_one():
    """Per unit of k the union offers the same box of end points, so k of `sample` is uniform."""
    assert answer().coverage.at_least >= 0.9
    assert 1 <= density_of_k(covering(1.0)) <= 1.03
    claim = answer().model.claim
    assert isinstance(answer().risk(), pj.types.NoStatement) == (claim.eps is None)


def test_the_risk_of_a_draw_is_that_of_bins_with_a_claim():
    """Nothing is safe in the others, so no plan is drawn there."""
    claim = answer().model.claim
    eps, law = Fraction(1, 50), replace(claim.law, k_law="uniform")
    about = {"kind": "pac", "eps": eps, "delta": Fraction(1, 1000), "law": law}
    some = derived(claim, bin_eps=(None, eps, Fraction(1, 90)), **about)
    scene, model = answer().scene, answer().model
    of_all, of_some = (
        replace(answer(), scene=under(scene, model.replace(claim=c)))
        for c in (derived(claim, **about), some)
    )
    assert of_some.risk() == of_all.risk() and of_some.risk().bound >= eps
    assert isinstance(some.risk(density=1.0), pj.types.NoStatement)  # of any other law


@pytest.mark.parametrize("share", [0.5, 0.1])
def test_the_density_pays_for_what_the_corridors_do_not_cover(share):
    """Corridors that hold a share s of this safe set may be a slice of K of that share: then k of
    `sample` is 1 / s times as dense as uniform.
    """
    assert 1 / share <= density_of_k(covering(share)) <= 1.03 / share


def test_without_measured_coverage_no_density_is_stated():
    assert np.isinf(density_of_k(covering(0.0)))


def test_the_volume_interval_is_clopper_pearson():
    counted = replace(answer(), cover=answer().cover._replace(drawn=1000, safe=300))
    estimate, low, high = np.array(counted.cover.safe_volume(0.99)) / answer().cover.volume
    assert estimate == pytest.approx(0.3)
    assert binom.sf(299, 1000, low) == pytest.approx(0.005, rel=1e-6)  # 300 or more
    assert binom.cdf(300, 1000, high) == pytest.approx(0.005, rel=1e-6)


def shared(goal=OPEN, final=0.0, at=None, **asked):
    """The safe share where no obstacle is: what the tube, the uncertainty and the start leave."""
    problem = pj.reach_avoid(goal, [], 0.1, **asked)
    return pj.Planner(line_model(4, 0.0, final)).solve(problem, KEY, SAMPLES, at=at)


@pytest.mark.parametrize(
    ("asked", "left"),
    [
        ({}, 1.0),
        ({"final": 0.1}, 0.64),  # a goal that shrinks by 0.1 on each side
        ({"final": 0.4}, 0.04),
        ({"goal": SLANTED}, 0.5),
        ({"goal": SLANTED, "final": 0.1}, 0.18),  # its rows shrink by 0.2: (0.6)^2 / 2
        ({"uncertainty": pj.Uncertainty(start=0.1)}, 0.64),
        ({"uncertainty": pj.Uncertainty(goal=[0.1, 0.1])}, 0.64),
        ({"at": (0.0, 0.0)}, 0.25),  # of the k in [-1, 1]^2
        ({"at": (0.0, 0.0), "final": 0.1}, 0.16),
    ],
    ids=str,
)
def test_the_safe_share_is_of_all_plans_that_were_asked_about(asked, left):
    """A wide tube or uncertainty leaves little, and nothing of what it takes is left out of
    account."""
    found = shared(**asked)
    said = found.share
    assert said.at_least <= left <= said.at_most + 1e-12 and said.share <= said.reaching + 1e-12
    assert said.at_most - said.at_least < 0.1
    assert f"Safe under an assumed tube: {100 * said.share:.3g} % of" in found.summary()
    doubt = found.scene.nominal.uncertainty is not None  # of which set, and what leaves so much
    assert ("with all that is uncertain, " in found.summary()) == doubt
    assert (" for all that is uncertain" in set_of(found)) == doubt
    assert (" from one start" in set_of(found)) == (found.scene.at is not None)


@pytest.mark.slow
@pytest.mark.parametrize("start", [False, True])
def test_the_safe_share_holds_the_truth_of_plans_drawn_plainly(rng, start):
    model, problem = toy_case(4, start=start)
    found = pj.Planner(model).solve(problem, KEY, SAMPLES)
    k = rng.uniform(model.domain.lo, model.domain.hi, (20_000, model.n_k))
    z = rng.uniform(found.scene.z_lo, found.scene.z_hi, (20_000, model.n_p))
    safe = verdicts(found.scene, z - ends_from(0.0, model, k), k).safe.mean()
    said = found.share
    error = 4 * np.sqrt(safe / 20_000)
    assert said.at_least - error < safe < said.at_most + error and 0 < said.share < said.reaching


def test_without_uniform_draws_there_is_no_safe_share():
    counted = replace(answer(), cover=answer().cover._replace(volume=float("nan")))
    assert (
        counted.share is None
        and "assumed tube: what share of the plans was not" in counted.summary()
    )


def test_a_few_safe_draws_are_an_interval_and_no_estimate():
    few = replace(answer(), cover=answer().cover._replace(drawn=40, reaching=30, safe=3))
    # Clopper-Pearson of 3 in 40
    assert (
        f"Safe under an assumed tube: 0.862 % to 24.9 % of {IN_THE_BOX}, with confidence 0.99."
        in few.summary()
    )
    place = Place(np.zeros(4), 0.1 * np.eye(4))  # draws of a place alone bound nothing beyond
    around = replace(few, cover=few.cover._replace(within=place)).summary()
    assert "with confidence 0.99, counting only those around what a search found." in around
    asked = replace(few.scene.nominal, uncertainty=Robustness("x", Fraction(0), (2, 2), 4.0, True))
    doubt = replace(few, scene=replace(few.scene, nominal=asked)).summary()
    assert "with confidence 0.99, for all that is uncertain." in doubt
    many = few.cover._replace(drawn=400, reaching=300, safe=100, within=place)
    doubt = replace(few, cover=many, scene=replace(few.scene, nominal=asked)).summary()
    assert "confidence 0.99), for all that is uncertain, counting only those around" in doubt
