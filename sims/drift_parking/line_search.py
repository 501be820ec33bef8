"""Backtracking along 1, 0.95, 0.95^2, ...: the first step length that lowers the cost enough,
without trying them all.

A plain search costs some twenty evaluations per sweep, and 59 when no length passes, which ends
most solves. The gain is a smooth function of the step length, so five evaluations give an
interpolant; every length that it rejects by a wide margin is skipped, and from the first one that
might pass on the true cost decides. Near a pole of the tangent of the steering the interpolant does
not settle, the margin grows, and the search is the plain one.
"""

import jax
import jax.numpy as jnp
import numpy as np

STEP_SHRINK = 0.95
STEP_MIN = 0.05
ACCEPT_RATIO = 0.1  # actual over expected reduction
MARGIN = 10.0  # times the last two Chebyshev coefficients: how wrong the interpolant may be


def _step_lengths() -> np.ndarray:
    """1, 0.95, ... by repeated multiplication as in the search itself; the last one, below
    STEP_MIN, means none.
    """
    lengths = [1.0]
    while lengths[-1] > STEP_MIN:
        lengths.append(STEP_SHRINK * lengths[-1])
    return np.array(lengths)


LENGTHS = _step_lengths()
# Interpolation nodes in (0, 1]: Chebyshev-Lobatto points of [0, 1] without 0, where the gain is
# known to vanish.
NODES = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, 6) / 5)
_TO_CHEBYSHEV = np.linalg.inv(np.polynomial.chebyshev.chebvander(2.0 * NODES - 1.0, 4))
_TO_LENGTHS = np.polynomial.chebyshev.chebvander(2.0 * LENGTHS[1:] - 1.0, 4)


def first_accepted(cost_at, cost, expected, running):
    """(step length, accepted) per lane; lanes that are not running are never accepted.

    cost_at: step length -> cost. cost: at length zero. expected: G > 0; length e promises a
        reduction e G + e^2 G / 2.
    """

    def accepts(epsilon, new_cost):
        return (cost - new_cost) / (
            epsilon * expected + epsilon * epsilon * (0.5 * expected)
        ) > ACCEPT_RATIO

    epsilon = jnp.ones_like(cost)
    full_cost = cost_at(epsilon)
    accepted = running & accepts(epsilon, full_cost)

    def skip_ahead(epsilon):
        nodes = jnp.asarray(NODES[:-1], cost.dtype)
        node_costs = [
            *jax.lax.map(lambda node: cost_at(jnp.full_like(cost, node)), nodes),
            full_cost,
        ]
        # Surplus per unit length: positive where the ratio is above ACCEPT_RATIO.
        surplus = [
            (cost - node_costs[i]) / NODES[i] - ACCEPT_RATIO * expected * (1.0 + 0.5 * NODES[i])
            for i in range(len(NODES))
        ]
        series = [
            sum(float(w) * s for w, s in zip(row, surplus, strict=True)) for row in _TO_CHEBYSHEV
        ]
        bound = MARGIN * (jnp.abs(series[-1]) + jnp.abs(series[-2]))
        best = jnp.full_like(epsilon, LENGTHS[-1])
        for length, row in zip(LENGTHS[:0:-1], _TO_LENGTHS[::-1], strict=True):
            estimate = sum(float(w) * s for w, s in zip(row, series, strict=True))
            best = jnp.where(estimate < -bound, best, length)  # NaN counts as "might pass"
        return best

    searching = running & ~accepted
    epsilon = jnp.where(
        searching, jax.lax.cond(jnp.any(searching), skip_ahead, lambda e: e, epsilon), epsilon
    )

    def attempt(loop):
        epsilon, accepted = loop
        searching = running & ~accepted & (epsilon > STEP_MIN)
        passed = searching & accepts(epsilon, cost_at(epsilon))
        return jnp.where(searching & ~passed, STEP_SHRINK * epsilon, epsilon), accepted | passed

    def unsettled(loop):
        epsilon, accepted = loop
        return jnp.any(running & ~accepted & (epsilon > STEP_MIN))

    return jax.lax.while_loop(unsettled, attempt, (epsilon, accepted))
