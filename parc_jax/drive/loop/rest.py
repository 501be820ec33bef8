"""Does a model rest at the end of its manoeuvres? A look, which may refute it and proves nothing:
that a robot rests is assumed. [T38]
"""

from itertools import product

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from parc_jax.common.arrays import slices
from parc_jax.common.errors import InputError
from parc_jax.drive.loop.outlook import AT_ONCE
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import trajectories

LOOKED = 10  # 2 to the power of so many k, even over K ...
CORNERS = 10  # ... and the corners of K, up to so many parameters
ROUNDED = 1e-9  # [m] more than networks round by: a model that moves so little more is believed


def moved_last(
    model: TrajectoryModel, k: Float[np.ndarray, "b n_k"]
) -> tuple[Float[np.ndarray, " b"], Float[np.ndarray, " b"]]:
    """[m] by how much the prediction moves in the last interval, and by how much more than a robot
    that stands could be within the tube: of all points and axes the most.

    Who stands is off by at most the tube at the interval's beginning, and at its end by that and by
    what the tube allows at the end. Of k on an edge between bins any of them may allow it.
    """
    moved, beyond = [], []
    for some in slices(len(k), AT_ONCE):
        knots, _ = trajectories(model.net, model.layout, k[some])
        way = np.abs(knots[:, -1] - knots[:, -2])
        bins = model.tube.bins_of(k[some])
        during = model.tube.interval[bins, -1].max(axis=1)
        at_end = model.tube.final[bins, : model.n_c].max(axis=1)
        moved.append(way.max(axis=1))
        beyond.append((way - during - np.minimum(during, at_end)).max(axis=1))
    return np.concatenate(moved), np.concatenate(beyond)


def require_rest(
    model: TrajectoryModel, candidates: Float[np.ndarray, "b n_k"], given: tuple[int, ...]
) -> None:
    """Raises InputError for a model that moves in its last interval by more than its tube allows
    for who stands, at any k that is looked at: 2^LOOKED even over K, its corners, and all
    candidates, with what is measured in the middle of K.
    """
    lo, hi = model.domain.lo, model.domain.hi
    even = lo + qmc.Sobol(model.n_k, seed=0).random_base2(LOOKED) * (hi - lo)
    middle = candidates.copy()
    middle[:, list(given)] = ((lo + hi) / 2)[list(given)]
    corners = np.array(list(product(*zip(lo, hi, strict=True)))) if model.n_k <= CORNERS else even
    k = np.concatenate([even, corners, middle])
    moved, beyond = moved_last(model, k)
    i = int(np.argmax(beyond))
    if not beyond[i] <= ROUNDED:
        values = ", ".join(f"{x:.3g}" for x in k[i])
        raise InputError(
            f"Loop: expected a model whose manoeuvres end at rest; at k = ({values}) it moves by "
            f"{moved[i]:.3g} m in its last {model.time.dt:g} s, {beyond[i]:.3g} m more than its "
            f"tube allows for who stands. Learn it from runs that stop before {model.time.t_f:g} s."
        )
