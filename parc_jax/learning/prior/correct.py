"""What real runs say beyond a prior: their residuals, smoothed over K, where that helps others."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.runs.batch import RolloutBatch

SMOOTHINGS = (0.1, 1.0, 10.0)  # [1] of thin plates over K scaled to [-1, 1]; more is stiffer
FOLDS = 5  # parts of the training runs that take turns: each is predicted from the others
CLEARLY = 2.0  # [standard errors] by which they must help
_UNLIKE = 3.0  # [median size] residuals of runs that are larger count as so large


class Corrected(NamedTuple):
    """A prior at real runs, and what is added to it anywhere.

    predicted (n, m): places at all records and goal states at the k of the runs, as corrected.
    more: what of that is added, (n, m) at any k (n, n_k). smoothing: of the residuals; None where
    they are left out. errors (n, m): of every run as predicted from the other parts of them. alone,
    best [m]: the typical largest error of a run, by the prior and by the best of the corrections.
    """

    predicted: np.ndarray
    more: Callable[[np.ndarray], np.ndarray]
    smoothing: float | None
    errors: np.ndarray
    alone: float
    best: float

    def statement(self) -> str:
        """One sentence."""
        seen = (
            f"predicted from others, a training run is typically off by {self.alone:.2g} m by the "
            f"prior alone and by {self.best:.2g} m when their residuals correct it"
        )
        if self.smoothing is None:
            return f"residuals left out ({seen}, which is not clearly less)"
        return f"corrected by residuals ({seen})"


def corrected(prior: Callable[[np.ndarray], np.ndarray], runs: RolloutBatch) -> Corrected:
    """A prior, corrected by the residuals of finite runs where every fifth of these, as predicted
    from the others, is clearly nearer for it.

    prior: from a mask (n,) of the runs that it may know to what it predicts for all of them, (n, m)
    places at all records, then goal states.
    """
    truth = flat(runs)
    choices = (None, *SMOOTHINGS)
    errors = {choice: np.zeros_like(truth) for choice in choices}
    for fit, held in folds(runs):
        rest = truth - prior(fit)
        for choice in choices:
            more = _smoothed(runs.select(fit), rest[fit], choice)
            errors[choice][held] = rest[held] - more(runs.k[held])
    sizes = {
        choice: np.log(largest(runs, e) + TOLERANCES.profile_floor) for choice, e in errors.items()
    }
    best = min(SMOOTHINGS, key=lambda choice: sizes[choice].mean())
    less = sizes[None] - sizes[best]
    chosen = best if less.mean() > CLEARLY * less.std() / np.sqrt(len(less)) else None
    whole = prior(np.ones(runs.n, bool))
    more = _smoothed(runs, truth - whole, chosen)
    typical = (float(np.exp(sizes[choice].mean())) for choice in (None, best))
    return Corrected(whole + more(runs.k), more, chosen, errors[chosen], *typical)


def folds(runs: RolloutBatch) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Masks (n,) of the rows to fit and of those held out, in turn; groups stay whole."""
    own = np.arange(runs.n) if runs.groups is None else runs.groups
    number = np.unique(own, return_inverse=True)[1].ravel() % FOLDS
    for part in range(FOLDS):
        if (number == part).any() and (number != part).any():
            yield number != part, number == part


def flat(runs: RolloutBatch) -> np.ndarray:
    """(n, m) places at all records, then goal states."""
    return np.concatenate([np.asarray(runs.p, np.float64).reshape(runs.n, -1), runs.q], axis=1)


def largest(runs: RolloutBatch, errors: np.ndarray) -> np.ndarray:
    """(n,) [m] the largest of the errors (n, m) of every run in a coordinate of a place."""
    return np.abs(errors[:, : errors.shape[1] - runs.n_q]).max(axis=1)


def _smoothed(runs: RolloutBatch, residual: np.ndarray, smoothing: float | None) -> Callable:
    """Residuals (n, m) of runs as a function of k."""
    if smoothing is None:
        return lambda k: np.zeros((len(k), residual.shape[1]))
    from scipy.interpolate import RBFInterpolator

    size = np.abs(residual).max(axis=1)
    tame = residual * np.minimum(1.0, _UNLIKE * np.median(size) / np.maximum(size, 1e-12))[:, None]
    lo, hi = runs.domain.lo, runs.domain.hi

    def in_unit(k):
        return (2 * k - lo - hi) / (hi - lo)

    plates = RBFInterpolator(in_unit(runs.k), tame, smoothing=smoothing, degree=1)
    return lambda k: plates(in_unit(k))
