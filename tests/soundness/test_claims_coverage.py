"""Are claims wrong as rarely as they say? Repeated calibrations where the truth is known. [T1,
T2]
"""

import jax
import numpy as np
import pytest
from profiles import training_profile
from scored import score_system
from synthetic_plants import (
    between_knots,
    disturbed,
    exact,
    goal_only,
    noisy,
    plant,
    spike,
    straight_network,
)

from parc_jax.common.keys import Stage
from parc_jax.learning.bound.calibrate import calibrate, kept_maximum
from parc_jax.learning.bound.counts import required_runs, wrong_claim_probability
from parc_jax.learning.bound.measure import measure
from parc_jax.learning.bound.monitor import inside_tube
from parc_jax.learning.runs.collect import collect

NET = straight_network(4)
pytestmark = pytest.mark.soundness

# Laws of a score with their exact survival function P(S > s).
LAWS = {
    "uniform": (lambda u: u, lambda s: 1 - s),
    "exponential": (lambda u: -np.log1p(-u), lambda s: np.exp(-s)),
    "heavy": (lambda u: (1 - u) ** -2.0, lambda s: s**-0.5),
    "discrete": (lambda u: np.floor(u * 200), lambda s: 1 - (s + 1) / 200),
    "failing": (
        lambda u: np.where(u > 0.99, np.inf, u),
        lambda s: np.where(np.isinf(s), 0.0, 1 - s),
    ),
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("discard", [0, 3])
def test_wrong_claims_are_as_rare_as_the_theorem_says(law, discard):
    draw, survival = LAWS[law]
    n, eps, repeats = 300, 0.02 if discard == 0 else 0.035, 20_000
    score = draw(np.random.default_rng(11).random((repeats, n)))
    wrong = (survival(kept_maximum(score, discard)) > eps).mean()
    bound = wrong_claim_probability(n, eps, discard)
    error = np.sqrt(bound / repeats)
    assert wrong <= bound + 4 * error  # 4 standard errors: one false failure in 30,000
    if law in ("uniform", "exponential", "heavy"):
        assert (
            wrong >= bound - 4 * error
        )  # equality for continuous scores: the theorem is not loose


@pytest.mark.slow
def test_wrong_claims_on_a_plant_from_end_to_end():
    system, eps, delta, repeats = plant(noisy), 0.03, 0.05, 200
    n = required_runs(eps, delta)
    train = collect(system, jax.random.PRNGKey(1), 400, quiet=True)
    profile = training_profile(NET, train, (4, 1))
    holdout = score_system(
        NET, system, jax.random.PRNGKey(2), profile, repeats * n, chunk=2048, quiet=True
    )
    truth = score_system(
        NET, system, jax.random.PRNGKey(3), profile, 60_000, Stage.VALIDATE, chunk=2048, quiet=True
    ).score
    scales = kept_maximum(holdout.score.reshape(repeats, n), 0)
    violated = (truth[None] > scales[:, None]).mean(axis=1)
    wrong = (violated > eps).mean()
    assert wrong <= delta + 4 * np.sqrt(delta * (1 - delta) / repeats)
    assert violated.mean() == pytest.approx(1 / (n + 1), rel=0.3)  # the marginal reading


@pytest.mark.slow
def test_an_error_spike_in_a_sliver_of_k_keeps_the_claim_true():
    system, width, height = plant(spike(1e-4, 10.0)), 1e-4, 10.0
    profile = training_profile(
        NET, collect(plant(exact), jax.random.PRNGKey(1), 50, quiet=True), (1, 1)
    )
    outcomes = []
    for seed in range(6):
        scores = score_system(
            NET, system, jax.random.PRNGKey(seed), profile, 6905, chunk=1024, quiet=True
        )
        claim = calibrate(NET, scores, profile, eps=1e-3, delta=1e-3)
        violated = 0.0 if claim.tube.final[0, 0] >= height else width  # exact, by construction
        assert violated <= claim.eps
        outcomes.append(violated)
    assert (
        0.0 in outcomes and width in outcomes
    )  # a holdout of this size misses the sliver half the time


@pytest.mark.parametrize(
    ("run", "where"), [(between_knots(), "interval"), (goal_only, "final"), (disturbed, "interval")]
)
@pytest.mark.slow
def test_errors_that_hide_in_one_place_are_held(run, where):
    system = plant(run, 4, 10)
    profile = training_profile(NET, collect(system, jax.random.PRNGKey(1), 50, quiet=True), (1, 1))
    scores = score_system(NET, system, jax.random.PRNGKey(2), profile, 688, quiet=True)
    claim = calibrate(NET, scores, profile, eps=1e-2, delta=1e-3)
    new = collect(system, jax.random.PRNGKey(3), 4000, Stage.VALIDATE, quiet=True)
    assert (~inside_tube(claim, NET, new)).mean() <= 0.01 + 4 * np.sqrt(0.01 / 4000)
    assert getattr(claim.tube, where).max() > 0.2
    if run is goal_only:
        assert claim.tube.interval.max() < 0.01  # and nothing is spent elsewhere


# --- controls that must fail: each breaks one rule and is then wrong far more often than delta ---


@pytest.mark.slow
def test_the_measured_violation_of_a_default_claim():
    system = plant(noisy)
    train = collect(system, jax.random.PRNGKey(1), 1000, quiet=True)
    profile = training_profile(NET, train, (8, 1))
    scores = score_system(NET, system, jax.random.PRNGKey(2), profile, 6905, chunk=1024, quiet=True)
    claim = calibrate(NET, scores, profile, eps=1e-3, delta=1e-3, train=train)
    new = collect(system, jax.random.PRNGKey(3), 20_000, Stage.VALIDATE, chunk=1024, quiet=True)
    assert (~inside_tube(claim, NET, new)).mean() <= 1e-3
    assert np.isfinite(measure(NET, new).interval).all()
