"""All places that a committed manoeuvre may take, as obstacles of another robot's loop. [T45]"""

import math
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from parc_jax.common.arrays import as_float64, content_hash
from parc_jax.common.errors import InputError, check_kind
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.spelling import exact
from parc_jax.drive.loop.commitment import Commitment, require_shared
from parc_jax.learning.system import TimeGrid
from parc_jax.problem.problem import SAME, Span
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.problem.world.movers import SLACK, directions, polytopes, reach_of
from parc_jax.problem.world.moving import spans_of


def reserved(
    commitment: Commitment, at: ArrayLike, time: TimeGrid, *, every: int = 1
) -> tuple[list[HPolytope], list[Span]]:
    """The places of a robot from a moment on, by its manoeuvre under way: its stop and where it
    rests for ever are among them. Obstacles and spans for `Loop.step` of another robot; the last
    one has all places from its span on, however long: the other then rests.

    commitment: of the robot that is in the way. at: [s] of the clock that both share, when the pose
    of the other is measured; not before the manoeuvre began. time: grid of the other's model.
    every: intervals of it per obstacle; more makes fewer and larger ones. Raises InputError.
    """
    check_kind("reserved commitment", commitment, Commitment)
    check_kind("reserved time", time, TimeGrid)
    age = Fraction(float(as_float64("at", at, ()))) - commitment.begin
    if age < -SAME or not isinstance(every, int | np.integer) or every < 1:
        raise InputError(
            f"reserved: expected every >= 1, and a moment from {exact(commitment.begin)} s on, "
            f"when the manoeuvre began; got {every!r} and {exact(age + commitment.begin)} s. Of "
            "two robots the one that is measured later decides later."
        )
    if not commitment.under_way:
        raise InputError(
            f"reserved: expected the manoeuvre that its robot has under way, `loop.under_way`; its "
            f"loop has left number {commitment.number} for another, or for another episode, or "
            "this is a copy, of which nothing is known."
        )
    if commitment.seen_outside:
        since = exact(commitment.seen_outside[0])
        raise InputError(
            f"reserved: expected a robot inside of its tube; at {since} s it was seen outside: "
            "nobody knows where it goes. Stop until it has begun again."
        )
    require_shared("reserved", commitment.drifted)
    asked = commitment.asked
    model, pose, known = asked.query.model, asked.pose, asked.query.problem.uncertainty
    if model.n_p != 2:
        raise InputError(f"reserved: expected a robot in the plane; got {model.n_p} axes.")
    A = directions(pose.heading or 0.0)
    # of the nominal model: a point for each vertex realisation
    reach = reach_of(asked.model, commitment.k, asked.problem.body, directions(0.0))
    # NaN would be no bound: `hpolytope` refuses it
    reach += A @ pose.place + np.abs(A) @ (known or Uncertainty()).shifts(2)
    reach += SLACK * (1 + np.abs(A).sum(axis=1))
    dt, step = Fraction(model.time.dt), Fraction(time.dt)
    # the first interval by whose begin it rests
    rests = min(max(math.ceil((len(reach) - 1) * dt / step - age / step), 0), time.n_steps)
    name = f"{content_hash(A, reach)[:12]} from 0"
    told = time.dt, float(age + commitment.begin), commitment, "", name
    spans = spans_of(0, rests - 1, every, *told)
    spans += spans_of(rests, time.n_steps - 1, time.n_steps, *told)
    ends = [(age + first * step, age + (last + 1) * step) for first, last in spans]
    ends[-1] = ends[-1][0], len(reach) * dt  # and for ever
    return polytopes(A, reach, dt, ends), spans
