"""How many of few runs to leave outside of a tube, fixed by others before they are seen. [T2]"""

import math

import numpy as np

from parc_jax.claim.counts import supported_eps

SURE = 0.9  # probability, by what the training runs show, that so many discards suffice
MOST_SHARE = 0.1  # of the holdout, but for failed runs: a tube that more may leave is hardly one


def advised_discards(sizes: np.ndarray, n: int, delta: float) -> int:
    """Discards for a holdout of n independent runs, from the largest errors (m,) of runs that have
    no part in it, infinite for failed ones.

    They are taken where eps times the width that the tube then needs is least: a tube half as wide
    is worth twice the eps. At most MOST_SHARE of the holdout is discarded, or as many more as fail:
    a failed run makes a tube infinite.
    """
    best, least = 0, math.inf
    for discard in range(n):
        eps, width = supported_eps(n, delta, discard), width_needed(sizes, n, discard)
        if eps is None or (discard > MOST_SHARE * n and math.isfinite(least)):
            break
        if float(eps) * width < least:
            best, least = discard, float(eps) * width
    return best


def width_needed(sizes: np.ndarray, n: int, discard: int) -> float:
    """The least of the sizes (m,) that all but `discard` of n runs like these keep below, with
    probability SURE; infinite for none. One more run than was seen may be beyond each of them: a
    first failure among the n must not make an end of all plans.
    """
    from scipy.special import bdtr

    ordered = np.sort(sizes)
    beyond = np.arange(len(ordered), 0, -1) / (len(ordered) + 1)
    enough = bdtr(float(discard), n, beyond) >= SURE
    return float(ordered[np.argmax(enough)]) if enough.any() else math.inf
