"""One network that says what several executions of a plan do, each point of the robot in each of
them. [T21, T22]

The executions stand side by side in every layer. What rounds (a shift of the input, a turn of the
output) is bounded, and the tube pays for it.
"""

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from parc_jax.common.sets.box import Box
from parc_jax.learning.network.predict import Layout
from parc_jax.learning.network.relu import ReLUNetwork, relu_network
from parc_jax.learning.network.rounding import TINY, UNIT
from parc_jax.problem.robust.realisations import Executions

UP = 1 + 2.0**-10  # pays for evaluating a bound in float64


class Copied(NamedTuple):
    """net: of the chosen parameters. rounding: of its outputs, by how much any of them may differ
    from the exact network's: (T + 1, m, V, R, n_p) of the points, (V, n_q) of q.
    """

    net: ReLUNetwork
    rounding: np.ndarray
    rounding_q: np.ndarray


def copied(
    net: ReLUNetwork, layout: Layout, executions: Executions, turns: np.ndarray, domain: Box
) -> Copied:
    """The network whose points are those of the robot (m) in every execution (V) under every map of
    the offsets turns (R, n_p, n_p), in this order, knot by knot; then q of every execution.

    domain: of the chosen parameters.
    """
    corners = executions.corners
    chosen = list(executions.chosen)
    n_v, n_r = len(corners), len(turns)
    shifted = [_shifted(net.weights[0], net.biases[0], corner) for corner in corners]
    first = np.concatenate([net.weights[0][:, chosen]] * n_v)
    weights = [first, *(_side_by_side(W, n_v) for W in net.weights[1:])]
    biases = [np.concatenate([b for b, _ in shifted]), *(np.tile(b, n_v) for b in net.biases[1:])]
    error = np.concatenate([e for _, e in shifted])
    size = np.maximum(np.abs(domain.lo), np.abs(domain.hi))
    for depth, (W, b) in enumerate(zip(weights, biases, strict=True)):
        if depth:
            error = np.abs(W) @ error * UP
        if depth + 1 < len(weights):
            size = (np.abs(W) @ size + np.abs(b)) * UP
    W, b = _by_knot(weights[-1], layout, n_v), _by_knot(biases[-1][:, None], layout, n_v)
    knots = W.points.shape[:4]
    out = [np.einsum("rpa,tmvac->tmvrpc", turns, part.points) for part in (W, b)]
    wide = np.einsum("rpa,tmvac->tmvrpc", np.abs(turns), np.abs(W.points)) @ size
    wide = wide + np.einsum("rpa,tmvac->tmvrpc", np.abs(turns), np.abs(b.points))[..., 0]
    own = _by_knot(error[:, None], layout, n_v)
    turned = np.einsum("rpa,tmva->tmvrp", np.abs(turns), own.points[..., 0])
    exact = np.isin(turns, (0.0, 1.0)).all() and (turns.sum(axis=2) == 1).all()
    rounds = 0.0 if exact else 8 * UNIT * wide + 8 * TINY
    last = np.concatenate([out[0].reshape(-1, W.points.shape[-1])[layout.n_p :], W.q])
    offsets = np.concatenate([out[1].reshape(-1)[layout.n_p :], b.q[:, 0]])
    assert knots[2] == n_v and out[0].shape[3] == n_r
    return Copied(
        relu_network([*weights[:-1], last], [*biases[:-1], offsets]),
        (turned + rounds) * UP,
        own.q.reshape(n_v, -1) * UP,
    )


class _ByKnot(NamedTuple):
    """Rows of an output layer: points (T + 1, m, V, n_p, c), zero where a point starts at p0; q
    (V n_q, c).
    """

    points: np.ndarray
    q: np.ndarray


def _by_knot(rows: np.ndarray, layout: Layout, n_v: int) -> _ByKnot:
    """rows (V n_out, c)."""
    by_copy = rows.reshape(n_v, -1, rows.shape[1])
    start = np.zeros((n_v, layout.n_p, rows.shape[1]))
    knots = np.concatenate([start, by_copy[:, : layout.n_offsets]], axis=1)
    knots = knots.reshape(n_v, layout.n_steps + 1, layout.n_points, layout.n_p, -1)
    q = by_copy[:, layout.n_offsets :].reshape(-1, rows.shape[1])
    return _ByKnot(np.moveaxis(knots, 0, 2), q)


def _shifted(W: np.ndarray, b: np.ndarray, corner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bias of the first layer with the corner's part of the input added, and how far each entry is
    from the exact one.
    """
    if not corner.any():
        return b, np.zeros(len(b))
    by = [Fraction(x) for x in corner]
    values, errors = [], []
    for row, own in zip(W, b, strict=True):
        exact = Fraction(own) + sum(Fraction(w) * x for w, x in zip(row, by, strict=True))
        values.append(float(exact))
        errors.append(float(abs(exact - Fraction(values[-1]))) * UP)
    return np.array(values), np.array(errors)


def _side_by_side(W: np.ndarray, n: int) -> np.ndarray:
    """(n r, n c) with W (r, c) in every block of the diagonal."""
    return np.kron(np.eye(n), W)
