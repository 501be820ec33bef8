"""Outlines of the safe polytopes of an answer file, from their patterns and directions."""

from itertools import combinations

import numpy as np

from parc_jax.plot import shapes
from parc_jax.problem import ReachAvoid
from parc_jax.sets.hpolytope import HPolytope

DIGITS = 6  # significant digits of an outline: enough for a screen


def piece_outlines(network: dict, tube: dict, problem: ReachAvoid, sets: list[dict], T: int, n_k: int) -> dict:
    """Per pair of coordinates of (p0, k), written "i,j", the outlines [[x, y], ...] of the polytopes that have one.

    Pairs: the workspace, and all pairs of parameters. A polytope too thin for floating-point geometry is left out.
    """
    pairs = [(0, 1), *((2 + i, 2 + j) for i, j in combinations(range(n_k), 2))]
    out: dict[str, list] = {f"{i},{j}": [] for i, j in pairs}
    for piece in sets:
        corners = corners_of(piece_rows(network, tube, problem, piece, T), np.array(piece["p0"] + piece["k"]))
        if corners is not None:
            for i, j in pairs:
                out[f"{i},{j}"].append([[_short(x), _short(y)] for x, y in shapes.hull(corners[:, [i, j]])])
    return out


def piece_rows(network: dict, tube: dict, problem: ReachAvoid, piece: dict, T: int) -> HPolytope:
    """The polytope of a set piece over (p0, k), in float64: region, bin, goal, start and separations."""
    n_k = len(piece["k"])
    edges = [np.array(e) for e in tube["edges"]]
    index = np.unravel_index(piece["bin"], [len(e) - 1 for e in edges])
    lo, hi = (np.array([e[i + side] for e, i in zip(edges, index, strict=True)]) for side in (0, 1))
    interval, final = np.array(tube["interval"][piece["bin"]]), np.array(tube["final"][piece["bin"]])
    (region_A, region_b), C, d = pattern_map(network, piece["pattern"], n_k)
    offset_C = np.concatenate([np.zeros((1, 2, n_k)), C[: 2 * T].reshape(T, 2, n_k)])
    offset_d = np.concatenate([np.zeros((1, 2)), d[: 2 * T].reshape(T, 2)])
    goal_p, goal_q = problem.goal.A[:, :2], problem.goal.A[:, 2:]
    only_k = lambda A: np.concatenate([np.zeros((len(A), 2)), A], axis=1)  # noqa: E731
    rows = [
        (only_k(np.eye(n_k)), hi),
        (only_k(-np.eye(n_k)), -lo),
        (only_k(region_A), region_b),
        (
            np.concatenate([goal_p, goal_p @ offset_C[-1] + goal_q @ C[2 * T :]], axis=1),
            problem.goal.b - np.abs(problem.goal.A) @ final - goal_p @ offset_d[-1] - goal_q @ d[2 * T :],
        ),
    ]
    if problem.start is not None:
        rows.append((np.pad(problem.start.A, ((0, 0), (0, n_k))), problem.start.b))
    for runs in piece["sep"]:
        for first, end, *w, reach in runs:
            w = np.array(w)
            need = reach + interval[first:end] @ np.abs(w)
            for shift in (0, 1):
                knots = slice(first + shift, end + shift)
                A = np.concatenate([np.broadcast_to(w, (end - first, 2)), w @ offset_C[knots]], axis=1)
                rows.append((-A, offset_d[knots] @ w - need))
    return HPolytope(np.concatenate([A for A, _ in rows]), np.concatenate([b for _, b in rows]))


def pattern_map(network: dict, pattern: str, n_k: int):
    """Rows (A, b) of the region of an activation pattern, and the network's map C (n_out, n_k), d (n_out,) on it."""
    C, d, at = np.eye(n_k), np.zeros(n_k), 0
    A, b = np.zeros((0, n_k)), np.zeros(0)
    weights, biases = [np.array(W) for W in network["weights"]], [np.array(v) for v in network["biases"]]
    for W, beta in zip(weights[:-1], biases[:-1], strict=True):
        C, d = W @ C, W @ d + beta
        on = np.array([mark == "1" for mark in pattern[at : at + len(beta)]])
        at += len(beta)
        sign = np.where(on, -1.0, 1.0)
        A, b = np.concatenate([A, sign[:, None] * C]), np.concatenate([b, -sign * d])
        C, d = np.where(on[:, None], C, 0.0), np.where(on, d, 0.0)
    return (A, b), weights[-1] @ C, weights[-1] @ d + biases[-1]


def corners_of(poly: HPolytope, inside: np.ndarray) -> np.ndarray | None:
    """Vertices (v, n) of a bounded polytope with a known inner point; None when it is too thin."""
    from scipy.spatial import HalfspaceIntersection, QhullError

    room = poly.b - poly.A @ inside
    size = np.abs(poly.A)
    real = size.sum(axis=1) > 0
    room, size, A = room[real], size[real], poly.A[real]
    if not (room > 0).all():
        return None
    scale = np.where(size > 0, room[:, None] / np.where(size > 0, size, 1.0), np.inf).min(axis=0)
    try:
        cut = HalfspaceIntersection(np.column_stack([A * scale, -room]), np.zeros(len(inside)))
    except (QhullError, ValueError):
        return None
    return inside + cut.intersections * scale if np.isfinite(cut.intersections).all() else None


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
