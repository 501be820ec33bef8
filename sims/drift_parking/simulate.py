"""The closed loop: plan, track until the sideslip test fires, brake for four seconds, stand still.

One driver for every plant, elementwise over any lanes (trajectories) in the trailing axes. No
branch depends on k: the controller is solved at fixed stages of fixed steps, the tracking phase
always runs to its last admissible end, and the braking phase starts from the sample picked out
afterwards.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from sims.drift_parking import control, ilqr
from sims.drift_parking import params as c
from sims.drift_parking.plan import reference_plan
from sims.drift_parking.runge_kutta import begin, evaluate, stages
from sims.drift_parking.vehicle import Plant, State

# Plan index j is solved before evaluation 1 of step 10 j - 5; j = 6..12 before evaluation 3 of step
# 10 j - 6. (It is due at t = 0.1 j - 0.05, and the rounding of accumulated times decides which of
# the two evaluations sees it first.)
EARLY_FIRST, EARLY_LAST = 6, 12
N_SOLVES = (
    39  # blocks of ten steps; enough for the switch test to look 9 samples beyond SWITCH_LATEST
)


class Run(NamedTuple):
    """One closed-loop run.

    states: fields (N_RECORD + 1, *lanes). switch (*lanes): sample n_s, 0 when the test never fired
    in time. steer (*lanes): steering handed over at the switch [rad].
    """

    states: State
    switch: jax.Array
    steer: jax.Array


def simulate(plant: Plant, k) -> Run:
    """Run with k (2, *lanes) = (v [m/s], threshold sideslip [rad]). No switch by 3.8 s gives NaN
    states.
    """
    if k.ndim == 1:
        return _one(plant)(k)
    tracked, steers = _track(plant, k[0])
    switch = _switch_sample(tracked.sideslip, k[1])
    handed, steer = jax.tree.map(lambda a: _pick(a, switch[None])[0], (tracked, steers))
    braked = _brake(plant, handed, steer)
    return Run(_placed(tracked, braked, switch), switch, steer)


def _one(plant):
    """`simulate` of one k (2,), whose lanes under `vmap` are a trailing axis: only there can the
    controller tell them apart.
    """

    @jax.custom_batching.custom_vmap
    def run(k):
        return jax.tree.map(lambda a: a[..., 0], simulate(plant, k[:, None]))

    @run.def_vmap
    def runs(axis_size, in_batched, k):
        del axis_size
        lanes = jax.tree.map(lambda a: jnp.moveaxis(a, -1, 0), simulate(plant, k.T))
        return lanes, jax.tree.map(lambda _: in_batched[0], lanes)

    return run


def _track(plant, v):
    """Samples 0, 1, ... of the tracking phase: the states, and the steering applied last before
    each.

    A block starts before evaluation 3 of step 10 j - 6. In its first four evaluations lie the two
    places where the controller may be due; nine steps follow, all shifted by three evaluations so
    that one program serves both places.
    """
    plan = reference_plan(v)

    def move(point, controller, rows):
        return evaluate(lambda z, law: _track_law(plant, z, law, controller.command), point, rows)

    def sample(point):
        return point.sample, point.memory_then.steer

    def shifted_steps(point, controller, n):
        def step(point, _):
            point = move(point, controller, stages((3, 0, 1, 2)))
            return point, sample(point)

        return jax.lax.scan(step, point, length=n)

    def block(carry, j):
        def half(carry, place):
            (point, controller), (due, rows) = carry, place
            pose = ilqr.Pose(point.now.x, point.now.y, point.now.yaw, point.now.speed)
            controller = jax.lax.cond(
                due, lambda m: ilqr.solve(m, plan, j, pose), lambda m: m, controller
            )
            return (move(point, controller, rows), controller), None

        early = (j >= EARLY_FIRST) & (j <= EARLY_LAST)
        places = jnp.stack([early, ~early]), stages([(3, 0), (1, 2)])
        (point, controller), _ = jax.lax.scan(half, carry, places)
        begun = sample(point)
        point, rest = shifted_steps(point, controller, 9)
        return (point, controller), jax.tree.map(
            lambda a, b: jnp.concatenate([a[None], b]), begun, rest
        )

    def lanes(value):
        return jnp.full(v.shape, value, bool if isinstance(value, bool) else v.dtype)

    at_rest, started = jax.tree.map(lanes, (control.START, control.after_start()))
    controller = ilqr.first(plan)
    point = begin(*started)
    first = jax.tree.map(lambda a, b: jnp.stack([a, b]), (at_rest, lanes(0.0)), sample(point))
    point, lead = shifted_steps(move(point, controller, stages((0, 1, 2))), controller, 3)
    _, blocks = jax.lax.scan(block, (point, controller), jnp.arange(1, N_SOLVES + 1))
    return jax.tree.map(
        lambda a, b, d: jnp.concatenate([a, b, d.reshape(-1, *v.shape)]), first, lead, blocks
    )


def _switch_sample(sideslip, threshold):
    """n_s = i + 1 for the first i with SWITCH_RUN samples in a row beyond the threshold; 0 when
    none is in time.
    """
    beyond = sideslip > threshold[None]
    runs = jnp.stack([beyond[i : i + c.SWITCH_LATEST] for i in range(c.SWITCH_RUN)]).all(axis=0)
    return jnp.where(runs.any(axis=0), jnp.argmax(runs, axis=0) + 1, 0)


def _brake(plant, handed, steer):
    """States 0..BRAKE_STEPS of the braking phase."""
    sin, cos = jnp.sin(handed.sideslip), jnp.cos(handed.sideslip)
    z = handed._replace(ux=handed.speed * cos, uy=handed.speed * sin)

    def step(carry, _):
        point = evaluate(
            lambda z, steer: control.brake(plant, z, steer), begin(*carry), stages((0, 1, 2, 3))
        )
        return (point.sample, point.memory), point.sample

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


_track_law = jax.jit(control.track, static_argnums=0)  # evaluated in four places, traced once
