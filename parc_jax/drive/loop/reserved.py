"""All places that a committed manoeuvre may take, as obstacles of another robot's loop. [T45]"""

import math
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.common.sets.hpolytope import HPolytope, hpolytope
from parc_jax.drive.loop.commitment import Commitment
from parc_jax.learning.bound.error_set import at as errors_at
from parc_jax.learning.network.predict import trajectories
from parc_jax.learning.system import TimeGrid
from parc_jax.problem.body import Disc, numbered
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.problem.world.moving import Span

SIDES = 8  # of a polytope that holds the robot
SLACK = 1e-6  # [m] outwards, more than floats round places within 1e5 m by
SAME = Fraction(1, 10**9)  # [s] moments that are one: SLACK is more than anybody drives in it


def reserved(
    commitment: Commitment, at: ArrayLike, time: TimeGrid, *, every: int = 1
) -> tuple[list[HPolytope], list[Span]]:
    """The places of a robot from a moment on, by its manoeuvre under way: its stop and where it
    rests for ever are among them. Obstacles and spans for `Loop.step` of another robot; the last
    one has all places from its span on, however long: the other then rests.

    commitment: of the robot that is in the way. at: [s] of the clock that both share, when the pose
    of the other is measured; not before the manoeuvre began. time: grid of the other's model.
    every: intervals of it per obstacle; more makes fewer and larger ones.
    Raises InputError.
    """
    age = Fraction(float(as_float64("at", at, ()))) - commitment.begin
    if age < -SAME or every < 1:
        raise InputError(
            f"reserved: expected every >= 1, and a moment from {float(commitment.begin):g} s on, "
            f"when the manoeuvre began; got {every!r} and {float(age + commitment.begin):g} s. Of "
            "two robots the one that is measured later decides later."
        )
    if not commitment.under_way:
        raise InputError(
            f"reserved: expected the manoeuvre that its robot has under way, `loop.under_way`; its "
            f"loop has left number {commitment.number} for another, or for another episode."
        )
    if commitment.seen_outside:
        since = float(commitment.seen_outside[0])
        raise InputError(
            f"reserved: expected a robot inside of its tube; at {since:g} s it was seen outside: "
            "nobody knows where it goes. Stop until it has begun again."
        )
    A, reach = _reach(commitment)
    dt, step = Fraction(commitment.asked.model.time.dt), Fraction(time.dt)
    # the first interval by whose begin it rests
    rests = min(max(math.ceil((len(reach) - 1) * dt / step - age / step), 0), time.n_steps)
    spans = [(i, min(i + every, rests) - 1) for i in range(0, rests, every)]
    spans += [(rests, time.n_steps - 1)] * (rests < time.n_steps)
    obstacles = []
    for first, last in spans:
        begin = min(math.floor((age + first * step + SAME) / dt), len(reach) - 1)
        end = math.ceil((age + (last + 1) * step - SAME) / dt)
        end = len(reach) if last == time.n_steps - 1 else max(end, begin + 1)
        obstacles.append(hpolytope(A, reach[begin:end].max(axis=0)))
    return obstacles, spans


def _reach(commitment: Commitment) -> tuple[np.ndarray, np.ndarray]:
    """Normals A (SIDES, 2), and the offsets (T + 1, SIDES) of all of the body in each interval, and
    at rest. Raises InputError outside of the plane.
    """
    asked, pose = commitment.asked, commitment.asked.pose
    model, known = asked.model, asked.query.problem.uncertainty or Uncertainty()
    if model.n_p != 2:
        raise InputError(f"reserved: expected a robot in the plane; got {model.n_p} axes.")
    heading = pose.heading or 0.0
    own = 2 * np.pi / SIDES * np.arange(SIDES)  # in the frame of the manoeuvre
    w = np.stack([np.cos(own), np.sin(own)], axis=1)
    A = np.stack([np.cos(own + heading), np.sin(own + heading)], axis=1)
    knots = trajectories(model.net, model.layout, commitment.k[None])[0][0]
    bins = np.atleast_1d(model.tube.bins_of(commitment.k[None])[0])
    reach = np.full((len(knots), SIDES), -np.inf)
    for part in numbered(asked.problem.body, model.points):
        shape = part.shape
        if isinstance(shape, Disc):
            grown = np.full(SIDES, shape.radius)
        else:
            grown = (w @ shape.vertices.T).max(axis=1)
        for point in part.points:
            along = knots[:, 2 * point : 2 * point + 2] @ w.T
            errors = errors_at(model.tube.errors, (bins, slice(None), point))
            # (T, SIDES) of any bin
            lost = np.asarray(errors.support(w[:, None, None])).max(axis=1).T
            during = np.maximum(along[:-1], along[1:]) + lost
            rest = along[-1:] + lost[-1:]
            reach = np.maximum(reach, np.concatenate([during, rest]) + grown)
    moved = A @ pose.place + np.abs(A) @ known.shifts(2)
    # NaN would be no bound: `hpolytope` refuses it
    return A, reach + moved + SLACK * (1 + np.abs(w).sum(axis=1))
