"""Receding-horizon controller: iLQR over five kinematic steps, warm-started from the last solve.

Every quantity is a scalar and the horizon is written out: under vmap each becomes one (B,) array, and XLA fuses the
4-by-4 algebra, of which most entries are known zeros, into a few loops over the batch.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from sims.drift_parking import params as c
from sims.drift_parking.plan import Plan

HORIZON = 5
STATE_WEIGHT = 70.0
FINAL_WEIGHT = 100.0
CHANGE_WEIGHT = 30.0  # on input changes
MAX_SWEEPS = 50
CONVERGED = 1e-3  # on the expected reduction
STEP_SHRINK = 0.95
STEP_MIN = 0.05
ACCEPT_RATIO = 0.1  # actual over expected reduction
T = c.PLAN_STEP


class Pose(NamedTuple):
    """Kinematic state: x, y [m], yaw [rad], speed [m/s]."""

    x: jax.Array
    y: jax.Array
    yaw: jax.Array
    speed: jax.Array


class Input(NamedTuple):
    """accel [m/s^2], steer [rad]."""

    accel: jax.Array
    steer: jax.Array


class Memory(NamedTuple):
    """What the controller keeps between solves. states: 6 Pose, inputs: 5 Input, gains: 5 pairs of rows (accel, steer)."""

    states: tuple[Pose, ...]
    inputs: tuple[Input, ...]
    gains: tuple[tuple[Pose, Pose], ...]

    @property
    def command(self) -> Input:
        """The input to apply until the next solve."""
        return self.inputs[0]


def first(plan: Plan) -> Memory:
    """The solve at plan index 0. The car stands on the plan, so the plan itself is optimal and only gains are needed."""
    states, inputs = _targets(plan, 0)
    _, gains, _ = _backward(states, inputs, states)
    return Memory(states, inputs, gains)


def solve(memory: Memory, plan: Plan, j, now: Pose) -> Memory:
    """The solve at plan index j >= 1 from the measured pose. The gains of the last solve are not shifted."""
    reference, new_inputs = _targets(plan, j)
    states = memory.states[1:] + reference[-1:]
    inputs = memory.inputs[1:] + new_inputs[-1:]
    states, inputs = _roll_out(now, states, inputs, memory.gains)
    cost = _cost(states, inputs, reference)

    def unfinished(loop):
        return ~loop[-1]

    def sweep(loop):
        sweeps, states, inputs, gains, cost, _ = loop
        steps, gains, expected = _backward(states, inputs, reference)
        converged = jnp.abs(1.5 * expected) < CONVERGED
        trial = _search(now, states, inputs, gains, steps, reference, cost, expected, converged)
        taken = ~converged & trial.accepted
        states, inputs, cost = _where(taken, (trial.states, trial.inputs, trial.cost), (states, inputs, cost))
        finished = converged | (trial.epsilon < STEP_MIN) | (sweeps + 1 >= MAX_SWEEPS)
        return sweeps + 1, states, inputs, gains, cost, finished

    start = (jnp.int32(0), states, inputs, memory.gains, cost, jnp.bool_(False))
    _, states, inputs, gains, _, _ = jax.lax.while_loop(unfinished, sweep, start)
    return Memory(states, inputs, gains)


class _Trial(NamedTuple):
    epsilon: jax.Array
    accepted: jax.Array
    states: tuple[Pose, ...]
    inputs: tuple[Input, ...]
    cost: jax.Array


def _search(now, states, inputs, gains, steps, reference, cost, expected, converged) -> _Trial:
    """Backtracking from a full step; the first try is written out because the loop is rarely entered."""

    def attempt(epsilon):
        new_states, new_inputs = _roll_out(now, states, inputs, gains, steps, epsilon)
        new_cost = _cost(new_states, new_inputs, reference)
        accepted = (cost - new_cost) / (epsilon * expected + epsilon * epsilon * (0.5 * expected)) > ACCEPT_RATIO
        return _Trial(jnp.where(accepted, epsilon, STEP_SHRINK * epsilon), accepted, new_states, new_inputs, new_cost)

    def searching(trial):
        return ~trial.accepted & (trial.epsilon > STEP_MIN) & ~converged

    return jax.lax.while_loop(searching, lambda trial: attempt(trial.epsilon), attempt(jnp.ones_like(cost)))


def _targets(plan: Plan, j):
    """Plan states j..j+5 and inputs j..j+4."""
    rows = [jax.lax.dynamic_slice_in_dim(field, j, HORIZON + 1) for field in plan]
    states = tuple(Pose(*(row[i] for row in rows[:4])) for i in range(HORIZON + 1))
    inputs = tuple(Input(*(row[i] for row in rows[4:])) for i in range(HORIZON))
    return states, inputs


def _move(xi: Pose, u: Input) -> Pose:
    """One kinematic step of length T."""
    reach = T * xi.speed
    return Pose(
        xi.x + reach * jnp.cos(xi.yaw),
        xi.y + reach * jnp.sin(xi.yaw),
        xi.yaw + reach * jnp.tan(u.steer) / c.WHEELBASE,
        xi.speed + T * u.accel,
    )


def _roll_out(now, states, inputs, gains, steps=None, epsilon=None):
    """Follow the nominal from `now` with feedback, plus epsilon times the open-loop steps when given."""
    new_states, new_inputs = [now], []
    for i, (xi, u, (row_a, row_s)) in enumerate(zip(states[:-1], inputs, gains, strict=True)):
        offset = Pose(*(a - b for a, b in zip(new_states[-1], xi, strict=True)))
        accel, steer = u.accel + _dot(row_a, offset), u.steer + _dot(row_s, offset)
        if steps is not None:
            accel, steer = accel + epsilon * steps[i].accel, steer + epsilon * steps[i].steer
        new_inputs.append(Input(accel, steer))
        new_states.append(_move(new_states[-1], new_inputs[-1]))
    return tuple(new_states), tuple(new_inputs)


def _cost(states, inputs, reference):
    """Without the factor 1/2 that the expansion has; the first input change counts as zero."""
    cost = sum(STATE_WEIGHT * _square(a, b) for a, b in zip(states[:-1], reference[:-1], strict=True))
    cost = cost + sum(CHANGE_WEIGHT * _square(b, a) for a, b in zip(inputs[:-1], inputs[1:], strict=True))
    return cost + FINAL_WEIGHT * _square(states[-1], reference[-1])


def _backward(states, inputs, reference):
    """Riccati sweep: (open-loop steps, feedback gains, expected reduction G). The second-order term Hs is G / 2.

    With k = -Quu^-1 Qu and K = -Quu^-1 Qux the value updates collapse to v = Qx + Qux' k, M = Qxx + Qux' K (symmetric).
    """
    v1, v2, v3, v4 = (FINAL_WEIGHT * (a - b) for a, b in zip(states[-1], reference[-1], strict=True))
    zero = jnp.zeros_like(v1)
    m11 = m22 = m33 = m44 = zero + FINAL_WEIGHT
    m12 = m13 = m14 = m23 = m24 = m34 = zero
    steps, gains, expected = [], [], zero
    for i in reversed(range(HORIZON)):
        xi, u, target = states[i], inputs[i], reference[i]
        change = Input(zero, zero) if i == 0 else Input(*(a - b for a, b in zip(u, inputs[i - 1], strict=True)))
        # Jacobian: A = I + [a13 a14; a23 a24; a34], B = [(4,1) = T; (3,2) = b].
        tan = jnp.tan(u.steer)
        cos, sin = T * jnp.cos(xi.yaw), T * jnp.sin(xi.yaw)
        a13, a14, a23, a24 = -sin * xi.speed, cos, cos * xi.speed, sin
        a34 = T / c.WHEELBASE * tan
        b = T / c.WHEELBASE * xi.speed * (1.0 + tan * tan)
        # M A; its first two columns are those of M.
        p13, p14 = m11 * a13 + m12 * a23 + m13, m11 * a14 + m12 * a24 + m13 * a34 + m14
        p23, p24 = m12 * a13 + m22 * a23 + m23, m12 * a14 + m22 * a24 + m23 * a34 + m24
        p33, p34 = m13 * a13 + m23 * a23 + m33, m13 * a14 + m23 * a24 + m33 * a34 + m34
        p43, p44 = m14 * a13 + m24 * a23 + m34, m14 * a14 + m24 * a24 + m34 * a34 + m44
        q1, q2, q3, q4 = (STATE_WEIGHT * (s - r) for s, r in zip(xi, target, strict=True))
        q1, q2 = q1 + v1, q2 + v2
        q3, q4 = q3 + a13 * v1 + a23 * v2 + v3, q4 + a14 * v1 + a24 * v2 + a34 * v3 + v4
        ga, gs = CHANGE_WEIGHT * change.accel + T * v4, CHANGE_WEIGHT * change.steer + b * v3
        row_a = (T * m14, T * m24, T * p43, T * p44)  # Qux
        row_s = (b * m13, b * m23, b * p33, b * p34)
        haa, has, hss = CHANGE_WEIGHT + T * T * m44, T * b * m34, CHANGE_WEIGHT + b * b * m33
        scale = 1.0 / (haa * hss - has * has)
        iaa, ias, iss = -hss * scale, has * scale, -haa * scale  # -Quu^-1
        ka, ks = iaa * ga + ias * gs, ias * ga + iss * gs
        gain_a = Pose(*(iaa * a + ias * s for a, s in zip(row_a, row_s, strict=True)))
        gain_s = Pose(*(ias * a + iss * s for a, s in zip(row_a, row_s, strict=True)))
        v1, v2, v3, v4 = (q + a * ka + s * ks for q, a, s in zip((q1, q2, q3, q4), row_a, row_s, strict=True))

        def corrected(value, r, col, row_a=row_a, row_s=row_s, gain_a=gain_a, gain_s=gain_s):
            return value + row_a[r] * gain_a[col] + row_s[r] * gain_s[col]

        m11, m12 = corrected(STATE_WEIGHT + m11, 0, 0), corrected(m12, 0, 1)
        m22 = corrected(STATE_WEIGHT + m22, 1, 1)
        m33 = corrected(STATE_WEIGHT + a13 * p13 + a23 * p23 + p33, 2, 2)
        m34 = corrected(a13 * p14 + a23 * p24 + p34, 2, 3)
        m44 = corrected(STATE_WEIGHT + a14 * p14 + a24 * p24 + a34 * p34 + p44, 3, 3)
        m13, m14, m23, m24 = corrected(p13, 0, 2), corrected(p14, 0, 3), corrected(p23, 1, 2), corrected(p24, 1, 3)
        steps.insert(0, Input(ka, ks))
        gains.insert(0, (gain_a, gain_s))
        expected = expected - (ga * ka + gs * ks)
    return tuple(steps), tuple(gains), expected


def _dot(row: Pose, offset: Pose):
    return row.x * offset.x + row.y * offset.y + row.yaw * offset.yaw + row.speed * offset.speed


def _square(a, b):
    return sum((s - t) * (s - t) for s, t in zip(a, b, strict=True))


def _where(condition, new, old):
    return jax.tree.map(lambda n, o: jnp.where(condition, n, o), new, old)
