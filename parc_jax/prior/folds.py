"""Training runs that take turns: each fifth of them is predicted from the others."""

from collections.abc import Iterator

import numpy as np

from parc_jax.rollout.batch import RolloutBatch

FOLDS = 5


def folds(runs: RolloutBatch) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Masks (n,) of the rows to fit and of those held out, in turn; groups stay whole."""
    own = np.arange(runs.n) if runs.groups is None else runs.groups
    number = np.unique(own, return_inverse=True)[1].ravel() % FOLDS
    for part in range(FOLDS):
        if (number == part).any() and (number != part).any():
            yield number != part, number == part


def worst_error(model, runs: RolloutBatch) -> np.ndarray:
    """(n,) [m] the largest error of a model with `rollout_batch`, of any coordinate at any time."""
    p = np.asarray(model.rollout_batch(None, runs.k).p).reshape(runs.p.shape)
    return np.abs(p - runs.p).max(axis=(1, 2))
