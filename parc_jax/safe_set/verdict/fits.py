"""Boxes around goals and start sets: where plans end and start."""

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.bounding_box import bounding_box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.network.predict import Layout


def finite_box(
    poly: HPolytope, name: str, needed: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Smallest box around a polytope, bounded along the needed axes (n,), by default all: rows
    along the axes are read off, others ask LPs. Raises InputError.
    """
    needed = np.ones(poly.n, bool) if needed is None else needed
    lo, hi = box_of_rows(poly)
    if (np.count_nonzero(poly.A, axis=1) != 1).any():
        try:
            around = bounding_box(poly)
        except InputError:
            raise InputError(
                f"{name}: expected a set with points in it; its rows contradict each other."
            ) from None
        lo, hi = np.maximum(lo, around.lo), np.minimum(hi, around.hi)
    return _checked(lo, hi, needed, name)


def goal_box(goal: HPolytope, layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """A box around the goal, which must bound the first point and q; where a robot has several
    points, the others may be free: infinite. Raises InputError.
    """
    if layout.n_points == 1:
        return finite_box(goal, "goal")
    needed = np.ones(goal.n, bool)
    needed[layout.n_p : layout.n_c] = False
    lo, hi = box_of_rows(goal)
    if (np.isfinite(lo) & np.isfinite(hi))[needed].all():
        return _checked(lo, hi, needed, "goal")
    return finite_box(goal, "goal", needed)


def box_of_rows(poly: HPolytope) -> tuple[np.ndarray, np.ndarray]:
    """The box that the rows along the axes make, infinite where there is none."""
    lo, hi = np.full(poly.n, -np.inf), np.full(poly.n, np.inf)
    single = np.count_nonzero(poly.A, axis=1) == 1
    for row, offset in zip(poly.A[single], poly.b[single], strict=True):
        axis = int(np.flatnonzero(row)[0])
        if row[axis] > 0:
            hi[axis] = min(hi[axis], offset / row[axis])
        else:
            lo[axis] = max(lo[axis], offset / row[axis])
    return lo, hi


def _checked(lo: np.ndarray, hi: np.ndarray, needed: np.ndarray, name: str):
    """lo, hi themselves, if the needed axes are bounded and none is empty. Raises InputError."""
    open_ = needed & ~(np.isfinite(lo) & np.isfinite(hi))
    if open_.any():
        axis = int(np.argmax(open_))
        raise InputError(
            f"{name}: expected a bounded set; axis {axis} has no bound. Add the missing rows."
        )
    if (lo > hi).any():
        axis = int(np.argmax(lo > hi))
        span = f"[{lo[axis]:g}, {hi[axis]:g}]"
        raise InputError(
            f"{name}: expected a set with points in it; axis {axis} asks for a value in {span}."
        )
    return lo, hi
