"""The closed loop: plan, track until the sideslip test fires, brake for four seconds, stand still.

One driver for every plant, elementwise over any lanes (trajectories) in the trailing axes. No branch depends on k: the
controller is solved at fixed stages of fixed steps, the tracking phase always runs to its last admissible end, and the
braking phase starts from the sample picked out afterwards.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from sims.drift_parking import control, ilqr
from sims.drift_parking import params as c
from sims.drift_parking.plan import reference_plan
from sims.drift_parking.vehicle import Plant, State, advance

# Classical Runge-Kutta: weight of each evaluation, and offset of the evaluation after it.
WEIGHTS = c.STEP * np.array([1.0, 2.0, 2.0, 1.0]) / 6.0
NEXT_OFFSETS = c.STEP * np.array([0.5, 0.5, 1.0, 0.0])
# Plan index j is solved in step 10 j - 5 before evaluation 1; j = 6..12 in step 10 j - 6 before evaluation 3. (It is
# due at t = 0.1 j - 0.05, and the rounding of accumulated times decides which of the two evaluations sees it first.)
EARLY_FIRST, EARLY_LAST = 6, 12
N_SOLVES = 39  # blocks of ten steps 10 j - 9 .. 10 j; enough for the switch test to look 9 samples beyond SWITCH_LATEST


class Run(NamedTuple):
    """One closed-loop run.

    states: fields (N_RECORD + 1, *lanes). switch (*lanes): sample n_s, 0 when the test never fired in time.
    steer (*lanes): steering handed over at the switch [rad].
    """

    states: State
    switch: jax.Array
    steer: jax.Array


def simulate(plant: Plant, k) -> Run:
    """Run with k (2, *lanes) = (v [m/s], threshold sideslip [rad]). No switch by 3.8 s gives NaN states."""
    tracked, steers = _track(plant, k[0])
    switch = _switch_sample(tracked.sideslip, k[1])
    handed, steer = jax.tree.map(lambda a: _pick(a, switch[None])[0], (tracked, steers))
    braked = _brake(plant, handed, steer)
    return Run(_placed(tracked, braked, switch), switch, steer)


def _evaluations(evaluate, z, point, first, last):
    """Evaluations first..last-1 of the step from z; point = (state of the evaluation, sum so far, memory of the law).

    evaluate(state, memory) -> (rate, memory). After the fourth one the sum so far is the state after the step.
    """

    def stage(point, coefficients):
        now, total, memory = point
        weight, next_offset = coefficients
        rate, memory = evaluate(now, memory)
        return (advance(z, rate, next_offset), advance(total, rate, weight), memory), None

    dtype = z.x.dtype
    rows = jnp.asarray(WEIGHTS[first:last], dtype), jnp.asarray(NEXT_OFFSETS[first:last], dtype)
    return jax.lax.scan(stage, point, rows)[0]


def _track(plant, v):
    """Samples 0, 1, ... of the tracking phase: the states, and the steering applied last before each."""
    plan = reference_plan(v)

    def step(carry, solve=None):
        """One step; solve = (evaluation before which the controller may be solved, plan index, is it due)."""
        z, law, controller = carry
        point = (z, z, law)
        begin = 0
        if solve is not None:
            begin, j, due = solve
            point = _evaluations(follow(controller), z, point, 0, begin)
            x, y, yaw, _, speed, *_ = point[0]
            pose = ilqr.Pose(x, y, yaw, speed)
            controller = jax.lax.cond(due, lambda m: ilqr.solve(m, plan, j, pose), lambda m: m, controller)
        _, z, law = _evaluations(follow(controller), z, point, begin, 4)
        return (z, law, controller), (z, law.steer)

    def follow(controller):
        return lambda z, law: control.track(plant, z, law, controller.command)

    def coast(carry, length):
        return jax.lax.scan(lambda carry, _: step(carry), carry, length=length)

    def block(carry, j):
        early = (j >= EARLY_FIRST) & (j <= EARLY_LAST)
        carry, head = coast(carry, 3)
        carry, sixth = step(carry, (3, j, early))
        carry, fifth = step(carry, (1, j, ~early))
        carry, tail = coast(carry, 5)
        return carry, jax.tree.map(
            lambda a, b, d, e: jnp.concatenate([a, b[None], d[None], e]), head, sixth, fifth, tail
        )

    def lanes(value):
        return jnp.full(v.shape, value, jnp.result_type(value) if isinstance(value, bool) else v.dtype)

    rest, (z, law) = jax.tree.map(lanes, (control.START, control.after_start()))
    _, samples = jax.lax.scan(block, (z, law, ilqr.first(plan)), jnp.arange(1, N_SOLVES + 1))
    begin = jax.tree.map(lambda a, b: jnp.stack([a, b]), (rest, law.steer), (z, law.steer))
    return jax.tree.map(lambda a, b: jnp.concatenate([a, b.reshape(-1, *v.shape)]), begin, samples)


def _switch_sample(sideslip, threshold):
    """n_s = i + 1 for the first i with SWITCH_RUN samples in a row beyond the threshold; 0 when none is in time."""
    beyond = sideslip > threshold[None]
    runs = jnp.stack([beyond[i : i + c.SWITCH_LATEST] for i in range(c.SWITCH_RUN)]).all(axis=0)
    return jnp.where(runs.any(axis=0), jnp.argmax(runs, axis=0) + 1, 0)


def _brake(plant, handed, steer):
    """States 0..BRAKE_STEPS of the braking phase."""
    sin, cos = jnp.sin(handed.sideslip), jnp.cos(handed.sideslip)
    z = handed._replace(ux=handed.speed * cos, uy=handed.speed * sin)

    def step(carry, _):
        z, steer = carry
        _, z, steer = _evaluations(lambda z, steer: control.brake(plant, z, steer), z, (z, z, steer), 0, 4)
        return (z, steer), z

    primed = control.steer_into_slip(z, steer)
    _, states = jax.lax.scan(step, (z, primed), length=c.BRAKE_STEPS)
    return jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), z, states)


def _placed(tracked, braked, switch):
    """Tracking before the switch, braking from it on, the last braking state held."""
    n = jnp.arange(c.N_RECORD + 1).reshape(-1, *(1,) * switch.ndim)
    since = jnp.clip(n - switch[None], 0, c.BRAKE_STEPS)
    index = jnp.where(n < switch[None], n, tracked.x.shape[0] + since)
    both = jax.tree.map(lambda a, b: jnp.concatenate([a, b]), tracked, braked)
    return jax.tree.map(lambda a: jnp.where(switch[None] > 0, _pick(a, index), jnp.nan), both)


def _pick(values, index):
    """values[index[n, lane], lane]."""
    return jnp.take_along_axis(values, index, axis=0, mode="clip")
