"""Smallest box around a set."""

import numpy as np

from parc_jax.errors import InputError
from parc_jax.sets.affine import Set
from parc_jax.sets.ahpolytope import AHPolytope, as_ah
from parc_jax.sets.box import Box
from parc_jax.sets.hpolytope import HPolytope
from parc_jax.sets.support import support


def bounding_box(s: Set) -> Box:
    """A box proved to contain s, tight to lp_gap: two LPs per coordinate.

    Infinite where s is unbounded or no bound was proved. Raises InputError if s is proved empty.
    """
    if isinstance(s, Box):
        return s
    eye = np.eye(s.n)
    found = support(s, np.concatenate([eye, -eye]))
    if (found.upper == -np.inf).any():
        raise InputError(
            "bounding_box: expected a set with points in it; its rows contradict each other."
        )
    return Box(-found.upper[s.n :], found.upper[: s.n])


def with_bounds(s: Set) -> AHPolytope:
    """The same set with proved bounds on its base points: two LPs per coordinate, worth it for many
    questions.

    Raises InputError if the base is proved empty.
    """
    s = as_ah(s)
    if np.isfinite(s.lo).all() and np.isfinite(s.hi).all():
        return s
    around = bounding_box(HPolytope(s.A, s.b))
    return s.replace(lo=np.maximum(s.lo, around.lo), hi=np.minimum(s.hi, around.hi))
