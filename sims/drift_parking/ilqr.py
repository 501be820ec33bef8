"""Receding-horizon controller: iLQR over five kinematic steps, warm-started from the last solve.

Arrays carry the horizon first and any lanes (trajectories) last, and all arithmetic is elementwise
over lanes, written
out per entry: many entries of the 4-by-4 algebra are known zeros, and XLA fuses the rest into a few
    vector loops.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from sims.drift_parking import params as c
from sims.drift_parking import trig
from sims.drift_parking.line_search import first_accepted
from sims.drift_parking.plan import Plan

HORIZON = 5
STATE_WEIGHT = 70.0
FINAL_WEIGHT = 100.0
CHANGE_WEIGHT = 30.0  # on input changes
MAX_SWEEPS = 50
CONVERGED = 1e-3  # on the expected reduction
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
    """What the controller keeps between solves: nominal states (6, *lanes), inputs (5, *lanes),
    gains (5, *lanes).

    gains is an Input of Pose: one row of the feedback matrix per input.
    """

    states: Pose
    inputs: Input
    gains: Input

    @property
    def command(self) -> Input:
        """The input to apply until the next solve, (*lanes)."""
        return jax.tree.map(lambda a: a[0], self.inputs)


def first(plan: Plan) -> Memory:
    """The solve at plan index 0. The car stands on the plan, so the plan is optimal already; only
    gains are needed.
    """
    reference, inputs = _targets(plan, 0)
    _, gains, _ = _backward(reference, inputs, reference)
    return Memory(reference, inputs, gains)


def solve(memory: Memory, plan: Plan, j, now: Pose) -> Memory:
    """The solve at plan index j >= 1 from the measured pose (*lanes). The gains of the last solve
    are not shifted.
    """
    reference, new_inputs = _targets(plan, j)
    states, inputs, gains = (
        _shift(memory.states, reference),
        _shift(memory.inputs, new_inputs),
        memory.gains,
    )
    rest = jax.tree.map(jnp.zeros_like, inputs)
    cost, states, inputs = _roll_out(now, states, inputs, gains, rest, 0.0, reference)
    search = _Search(states, inputs, gains, cost, jnp.full(cost.shape, True))
    search = _improved(search, now, reference)
    return Memory(search.states, search.inputs, search.gains)


class _Search(NamedTuple):
    """A solve on its way: Memory's fields, cost (*lanes), and which lanes still run (*lanes)."""

    states: Pose
    inputs: Input
    gains: Input
    cost: jax.Array
    running: jax.Array


def _improved(search: _Search, now, reference) -> _Search:
    """All sweeps, all lanes in step, or fewer if none is left running."""

    def going(loop):
        return (loop[0] < MAX_SWEEPS) & jnp.any(loop[1].running)

    def step(loop):
        return loop[0] + 1, _swept(loop[1], now, reference)

    return jax.lax.while_loop(going, step, (0, search))[1]


def _swept(search: _Search, now, reference) -> _Search:
    """One sweep: new gains, and the first step along them that lowers the cost enough."""
    states, inputs, gains, cost, running = search
    steps, new_gains, expected = _backward(states, inputs, reference)
    gains = _where(running, new_gains, gains)
    running &= jnp.abs(1.5 * expected) >= CONVERGED  # G + Hs, and Hs = G / 2

    def cost_at(epsilon):
        return _roll_out(now, states, inputs, gains, steps, epsilon, reference, unroll=HORIZON)[0]

    epsilon, running = first_accepted(cost_at, cost, expected, running)
    moved = _roll_out(now, states, inputs, gains, steps, epsilon, reference)
    cost, states, inputs = _where(running, moved, (cost, states, inputs))
    return _Search(states, inputs, gains, cost, running)


def _targets(plan: Plan, j):
    """Plan states j..j+5 and inputs j..j+4."""
    x, y, yaw, speed, accel, steer = (
        jax.lax.dynamic_slice_in_dim(field, j, HORIZON + 1) for field in plan
    )
    return Pose(x, y, yaw, speed), Input(accel[:-1], steer[:-1])


def _shift(old, new):
    """Drop the first entry, append the last of `new`."""
    return jax.tree.map(lambda a, b: jnp.concatenate([a[1:], b[-1:]]), old, new)


def _move(xi: Pose, u: Input) -> Pose:
    """One kinematic step of length T."""
    reach = T * xi.speed
    sin, cos = trig.sincos(xi.yaw)
    turn = reach / c.WHEELBASE * trig.tan(u.steer)
    return Pose(xi.x + reach * cos, xi.y + reach * sin, xi.yaw + turn, xi.speed + T * u.accel)


def _roll_out(now, states, inputs, gains, steps, epsilon, reference, unroll=1):
    """Follow the nominal from `now` with feedback plus epsilon times the open-loop steps: (cost,
    states, inputs).

    The cost has no factor 1/2, unlike its expansion, and the first input change is free.
    """
    change_weight = jnp.where(jnp.arange(HORIZON) == 0, 0.0, CHANGE_WEIGHT)

    def step(carry, row):
        xi, last, cost = carry
        nominal, u, gain, free, target, weight = row
        offset = jax.tree.map(jnp.subtract, xi, nominal)
        accel = u.accel + _dot(gain.accel, offset) + epsilon * free.accel
        u = Input(accel, u.steer + _dot(gain.steer, offset) + epsilon * free.steer)
        cost = cost + STATE_WEIGHT * _distance(xi, target) + weight * _distance(u, last)
        return (_move(xi, u), u, cost), (xi, u)

    start = (now, _at(inputs, 0), jnp.zeros_like(now.x))
    rows = (_head(states), inputs, gains, steps, _head(reference), change_weight)
    (end, _, cost), (states, inputs) = jax.lax.scan(step, start, rows, unroll=unroll)
    cost = cost + FINAL_WEIGHT * _distance(end, _at(reference, -1))
    return cost, jax.tree.map(lambda a, b: jnp.concatenate([a, b[None]]), states, end), inputs


def _backward(states, inputs, reference):
    """Riccati sweep: (open-loop steps (5, *lanes), feedback gains, expected reduction G). Hs is G /
    2.

    With k = -Quu^-1 Qu and K = -Quu^-1 Qux the value updates collapse to v = Qx + Qux' k and M =
    Qxx + Qux' K, which is symmetric. The previous input counts as a constant in the expansion.
    """
    # Jacobians: I + [a13 a14; a23 a24; a34] in the last two columns, and [(4,1) = T; (3,2) = b].
    # Before the loop, so that its many outputs do not each recompute the trigonometry.
    sin, cos = trig.sincos(states.yaw[:-1])
    tan, speed = trig.tan(inputs.steer), states.speed[:-1]
    jacobians = (-T * speed * sin, T * cos, T * speed * cos, T * sin)
    jacobians += (T / c.WHEELBASE * tan, T / c.WHEELBASE * speed * (1.0 + tan * tan))
    errors = jax.tree.map(lambda a, b: STATE_WEIGHT * (a - b)[:-1], states, reference)
    changes = jax.tree.map(
        lambda a: CHANGE_WEIGHT * jnp.concatenate([jnp.zeros_like(a[:1]), a[1:] - a[:-1]]), inputs
    )
    end = jax.tree.map(lambda a, b: FINAL_WEIGHT * (a - b)[-1], states, reference)
    zero = jnp.zeros_like(end.x)
    weight = zero + FINAL_WEIGHT
    hessian = (
        weight,
        zero,
        zero,
        zero,
        weight,
        zero,
        zero,
        weight,
        zero,
        weight,
    )  # upper triangle, row by row

    def step(carry, row):
        (v1, v2, v3, v4), (m11, m12, m13, m14, m22, m23, m24, m33, m34, m44), expected = carry
        (a13, a14, a23, a24, a34, b), error, change = row
        # Last two columns of M A; the first two are those of M.
        p13, p14 = m11 * a13 + m12 * a23 + m13, m11 * a14 + m12 * a24 + m13 * a34 + m14
        p23, p24 = m12 * a13 + m22 * a23 + m23, m12 * a14 + m22 * a24 + m23 * a34 + m24
        p33, p34 = m13 * a13 + m23 * a23 + m33, m13 * a14 + m23 * a24 + m33 * a34 + m34
        p43, p44 = m14 * a13 + m24 * a23 + m34, m14 * a14 + m24 * a24 + m34 * a34 + m44
        qx = (
            error.x + v1,
            error.y + v2,
            error.yaw + a13 * v1 + a23 * v2 + v3,
            error.speed + a14 * v1 + a24 * v2 + a34 * v3 + v4,
        )
        qa, qs = change.accel + T * v4, change.steer + b * v3
        qax, qsx = (T * m14, T * m24, T * p43, T * p44), (b * m13, b * m23, b * p33, b * p34)
        qaa, qas, qss = CHANGE_WEIGHT + T * T * m44, T * b * m34, CHANGE_WEIGHT + b * b * m33
        scale = 1.0 / (qaa * qss - qas * qas)
        iaa, ias, iss = -qss * scale, qas * scale, -qaa * scale  # -Quu^-1
        ka, ks = iaa * qa + ias * qs, ias * qa + iss * qs
        gain_a = [iaa * a + ias * s for a, s in zip(qax, qsx, strict=True)]
        gain_s = [ias * a + iss * s for a, s in zip(qax, qsx, strict=True)]
        v = tuple(q + a * ka + s * ks for q, a, s in zip(qx, qax, qsx, strict=True))
        qxx = {
            (0, 0): STATE_WEIGHT + m11,
            (0, 1): m12,
            (0, 2): p13,
            (0, 3): p14,
            (1, 1): STATE_WEIGHT + m22,
            (1, 2): p23,
            (1, 3): p24,
            (2, 2): STATE_WEIGHT + a13 * p13 + a23 * p23 + p33,
            (2, 3): a13 * p14 + a23 * p24 + p34,
            (3, 3): STATE_WEIGHT + a14 * p14 + a24 * p24 + a34 * p34 + p44,
        }
        hessian = tuple(
            q + qax[r] * gain_a[col] + qsx[r] * gain_s[col] for (r, col), q in qxx.items()
        )
        return (v, hessian, expected - (qa * ka + qs * ks)), (
            Input(ka, ks),
            Input(Pose(*gain_a), Pose(*gain_s)),
        )

    start, rows = (tuple(end), hessian, zero), (jacobians, errors, changes)
    (_, _, expected), (steps, gains) = jax.lax.scan(step, start, rows, reverse=True)
    return steps, gains, expected


def _head(states):
    return jax.tree.map(lambda a: a[:-1], states)


def _at(fields, i):
    return jax.tree.map(lambda a: a[i], fields)


def _dot(row: Pose, offset: Pose):
    return row.x * offset.x + row.y * offset.y + row.yaw * offset.yaw + row.speed * offset.speed


def _distance(a, b):
    """Squared distance."""
    return sum((s - t) * (s - t) for s, t in zip(a, b, strict=True))


def _where(lanes, new, old):
    """Per lane: new or old; leaves may have leading axes."""
    return jax.tree.map(
        lambda n, o: jnp.where(jnp.expand_dims(lanes, tuple(range(n.ndim - lanes.ndim))), n, o),
        new,
        old,
    )
