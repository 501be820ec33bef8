"""What a loop chooses from: parameters that are given, and values of those that are not."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.common.spelling import listed
from parc_jax.learning.labels import name_of
from parc_jax.learning.model import TrajectoryModel


def given_axes(model: TrajectoryModel, given: Sequence[str | int] | None) -> tuple[int, ...]:
    """Numbers of the given parameters: all that the system declares, by default these. Where the
    claim rests on runs no others, since it would not say what their start leaves hidden [T37].
    Raises InputError.
    """
    names = [name_of(label) for label in model.labels.k]
    given = model.given if given is None else given
    axes = tuple(names.index(g) if g in names else g for g in given)
    for axis in axes:
        if not (isinstance(axis, int) and 0 <= axis < model.n_k) or axes.count(axis) > 1:
            raise InputError(
                f"given: expected parameters of the model, each once ({', '.join(names)}); got "
                f"{axis!r}."
            )
    if len(axes) == model.n_k:
        raise InputError("given: expected at least one parameter to choose; all are given.")
    measured = [names[axis] for axis in model.given]
    if not set(model.given) <= set(axes):
        raise InputError(
            f"given: expected {listed(measured)}, all that {model.system or 'the robot'} measures "
            f"at the start; got {given!r:.200}. What is measured is not chosen."
        )
    others = [names[axis] for axis in axes if axis not in model.given]
    if others and model.claim.kind == "pac":
        raise InputError(
            f"given: expected what the runs of the claim measured at the start; the system does "
            f"not declare {listed(others)}. Declare `given` there and calibrate anew: then the "
            "claim lists HIDDEN_START."
        )
    return axes


def even_candidates(model: TrajectoryModel, given: tuple[int, ...], n: int) -> np.ndarray:
    """(n, n_k) even over the chosen parameters, none of them on an edge between bins."""
    chosen = [axis for axis in range(model.n_k) if axis not in given]
    share = qmc.Sobol(len(chosen), seed=0).random_base2(int(np.ceil(np.log2(n))))[:n]
    k = np.zeros((n, model.n_k))
    lo, hi = model.domain.lo[chosen], model.domain.hi[chosen]
    k[:, chosen] = lo + share * (hi - lo)
    return k


def own_candidates(model: TrajectoryModel, given: tuple[int, ...], values: ArrayLike) -> np.ndarray:
    """(b, n_k) of values of the chosen parameters alone. Raises InputError."""
    chosen = [axis for axis in range(model.n_k) if axis not in given]
    values = as_float64("candidates", values, (None, len(chosen)))
    lo, hi = model.domain.lo[chosen], model.domain.hi[chosen]
    if not len(values) or not ((lo <= values) & (values <= hi)).all():
        raise InputError("candidates: expected at least one, all of them within K.")
    k = np.zeros((len(values), model.n_k))
    k[:, chosen] = values
    return k
