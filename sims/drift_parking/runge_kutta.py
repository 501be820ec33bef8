"""Classical Runge-Kutta, one evaluation at a time, because the control laws act and remember at
every evaluation.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from sims.drift_parking import params as c
from sims.drift_parking.vehicle import State

WEIGHTS = c.STEP * np.array([1.0, 2.0, 2.0, 1.0]) / 6.0
NEXT_OFFSETS = c.STEP * np.array([0.5, 0.5, 1.0, 0.0])  # where the following evaluation takes place
COMPLETES = np.array([False, False, False, True])  # the step


class Point(NamedTuple):
    """A place between two evaluations.

    sample, memory_then: state and law memory when the last step was complete. now, memory: those
    the next evaluation will see. total: the sample plus the weighted rates of this step so far.
    """

    sample: State
    memory_then: Any
    now: State
    memory: Any
    total: State


def begin(z: State, memory) -> Point:
    """Before evaluation 0 of a step from z."""
    return Point(z, memory, z, memory, z)


def stages(indices):
    """The coefficients of evaluations 0..3, in any shape and order."""
    indices = np.asarray(indices)
    return WEIGHTS[indices], NEXT_OFFSETS[indices], COMPLETES[indices]


def evaluate(law, point: Point, rows) -> Point:
    """Perform the evaluations of `rows` (see `stages`) in turn. law: (state, memory) -> (rate,
    memory).
    """

    def one(point, row):
        weight, next_offset, completes = row
        rate, memory = law(point.now, point.memory)
        total = _advance(point.total, rate, weight)
        sample, memory_then = jax.tree.map(
            lambda new, old: jnp.where(completes, new, old),
            (total, memory),
            (point.sample, point.memory_then),
        )
        return Point(sample, memory_then, _advance(sample, rate, next_offset), memory, total), None

    weight, next_offset, completes = rows
    dtype = point.now.x.dtype
    rows = jnp.asarray(weight, dtype), jnp.asarray(next_offset, dtype), jnp.asarray(completes)
    return jax.lax.scan(one, point, rows)[0]


def _advance(z: State, rate: State, duration) -> State:
    return jax.tree.map(lambda a, b: a + duration * b, z, rate)
