"""The closed loop: plan, track until the sideslip test fires, brake for four seconds, stand still.

One driver for every plant. Nothing in the control flow depends on k, so that vmap over k keeps each branch and loop: the
controller is solved at fixed stages of fixed steps, the tracking phase always runs to its last admissible end, and the
braking phase starts from the sample picked out afterwards.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from sims.drift_parking import control, ilqr
from sims.drift_parking import params as c
from sims.drift_parking.plan import reference_plan
from sims.drift_parking.vehicle import Plant, State, advance

H = c.STEP
STAGES = ((0.0, H / 6.0), (0.5 * H, H / 3.0), (0.5 * H, H / 3.0), (H, H / 6.0))  # (offset, weight) of each evaluation
BLOCK = 10  # steps between solves
# Plan index j is solved at stage 2 of step 10 j - 5, except j = 6..12: at stage 4 of the step before (time ties fall so).
EARLY = range(6, 13)
LAST_SOLVE = 39
TRACK_END = 10 * LAST_SOLVE + 5  # samples of the tracking phase: the switch test looks 9 beyond SWITCH_LATEST


class Run(NamedTuple):
    """One closed-loop run. states: each field (N_RECORD + 1,); switch: sample n_s, 0 when the test never fired in time;
    steer: handed over at the switch [rad]."""

    states: State
    switch: jax.Array
    steer: jax.Array


def simulate(plant: Plant, k) -> Run:
    """Run once with k = (v [m/s], threshold sideslip [rad]), shape (2,). No switch by 3.8 s gives NaN states."""
    tracked, steers, slips = _track_phase(plant, k[0])
    switch = _switch_sample(tracked.sideslip, k[1])
    handed = jax.tree.map(lambda a: a[switch], tracked)
    braked = _brake_phase(plant, handed, steers[switch])
    return Run(_placed(tracked, braked, switch), switch, steers[switch])


def _step(evaluate, z, memory):
    """Classical Runge-Kutta with the control law inside: evaluate(stage, z, memory) -> (rate, memory), in stage order."""
    stage_z, end = z, z
    for stage, (_, weight) in enumerate(STAGES):
        rate, memory = evaluate(stage, stage_z, memory)
        end = advance(end, rate, weight)
        if stage < 3:
            stage_z = advance(z, rate, STAGES[stage + 1][0])
    return end, memory


def _track_phase(plant, v):
    """Samples 0..TRACK_END of the state and of the steering applied at the last stage before each."""
    plan = reference_plan(v)

    def step(carry, solves):
        z, law, mpc = carry

        def evaluate(stage, z, memory):
            law, mpc = memory
            if stage in solves:
                j, due = solves[stage]
                pose = ilqr.Pose(z.x, z.y, z.yaw, z.speed)
                mpc = jax.lax.cond(due, lambda m: ilqr.solve(m, plan, j, pose), lambda m: m, mpc)
            rate, law = control.track(plant, z, law, mpc.command)
            return rate, (law, mpc)

        z, (law, mpc) = _step(evaluate, z, (law, mpc))
        return (z, law, mpc), (z, law.steer)

    def coast(carry, _):
        return step(carry, {})

    def block(carry, solve):
        j, late, early_next = solve
        carry, first = step(carry, {1: (j, late)})
        carry, middle = jax.lax.scan(coast, carry, length=BLOCK - 2)
        carry, last = step(carry, {3: (j + 1, early_next)})
        return carry, jax.tree.map(lambda a, b, d: jnp.concatenate([a[None], b, d[None]]), first, middle, last)

    start = jax.tree.map(lambda a: jnp.full_like(v, a, dtype=jnp.asarray(a).dtype if isinstance(a, bool) else v.dtype), control.after_start())
    rest = jax.tree.map(lambda a: jnp.full_like(v, a), control.START)
    carry = (*start, ilqr.first(plan))
    carry, lead = jax.lax.scan(coast, carry, length=4)
    js = jnp.arange(1, LAST_SOLVE + 1)
    early = (js >= EARLY.start) & (js < EARLY.stop)
    carry, blocks = jax.lax.scan(block, carry, (js, ~early, jnp.roll(early, -1)))
    blocks = jax.tree.map(lambda a: a.reshape((-1, *a.shape[2:])), blocks)
    first = (rest, jnp.zeros_like(v)), (start[0], start[1].steer)
    states, steers = jax.tree.map(lambda a, b, l, m: jnp.concatenate([a[None], b[None], l, m]), *first, lead, blocks)
    return states, steers, None


def _switch_sample(sideslip, threshold):
    """n_s = i + 1 for the first i with SWITCH_RUN samples in a row beyond the threshold; 0 when there is none in time."""
    beyond = sideslip > threshold
    n = c.SWITCH_LATEST
    runs = jnp.stack([beyond[s : s + n] for s in range(c.SWITCH_RUN)]).all(axis=0)
    return jnp.where(runs.any(), jnp.argmax(runs) + 1, 0)


def _brake_phase(plant, handed, steer):
    """States 0..BRAKE_STEPS of the braking phase."""
    z = handed._replace(ux=handed.speed * jnp.cos(handed.sideslip), uy=handed.speed * jnp.sin(handed.sideslip))
    primed = control.steer_into_slip(z, steer)

    def step(carry, _):
        carry = _step(lambda stage, z, steer: control.brake(plant, z, steer), *carry)
        return carry, carry[0]

    _, states = jax.lax.scan(step, (z, primed), length=c.BRAKE_STEPS)
    return jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), z, states)


def _placed(tracked, braked, switch):
    """Tracking before the switch, braking from it on, the last braking state held."""
    n = jnp.arange(c.N_RECORD + 1)
    index = jnp.clip(n - switch, 0, c.BRAKE_STEPS)
    lead = jnp.minimum(n, TRACK_END)

    def one(a, b):
        placed = jnp.where(n < switch, a[lead], b[index])
        return jnp.where(switch > 0, placed, jnp.nan)

    return jax.tree.map(one, tracked, braked)
