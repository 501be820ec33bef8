"""Are claims wrong as rarely as they say? Repeated calibrations where the truth is known. [T1,
T2]
"""

import numpy as np
import pytest

from parc_jax.learning.bound.calibrate import kept_maximum
from parc_jax.learning.bound.counts import wrong_claim_probability

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


# --- controls that must fail: each breaks one rule and is then wrong far more often than delta ---
