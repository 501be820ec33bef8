"""A second opinion on plans in NumPy: 201 points of every segment against obstacle + (-body) + box(e), many at once.

Shares no code with the engine. Corners come from all pairs of rows, the sum with body and error box from all pairs of
corners, distances from every edge. Good for plans whose margins are far above 1e-9.
"""

import numpy as np

DEPTH = 1e-9  # [m] far above the rounding of these scenes


def polygon_corners(A, b) -> np.ndarray:
    """Corners (v, 2) of a bounded {x : A x <= b}, counter-clockwise hull."""
    i, j = np.triu_indices(len(b), 1)
    det = A[i, 0] * A[j, 1] - A[i, 1] * A[j, 0]
    i, j, det = i[det != 0], j[det != 0], det[det != 0]
    x = (b[i] * A[j, 1] - b[j] * A[i, 1]) / det
    y = (A[i, 0] * b[j] - A[j, 0] * b[i]) / det
    points = np.stack([x, y], axis=1)
    scale = np.abs(b) + np.abs(A).sum(axis=1)
    return convex_hull(points[(points @ A.T <= b + 1e-11 * scale).all(axis=1)])


def convex_hull(points) -> np.ndarray:
    """Counter-clockwise hull by gift wrapping on sorted points."""
    points = np.unique(np.asarray(points).round(13), axis=0)
    if len(points) <= 2:
        return points
    chains = []
    for sequence in (points, points[::-1]):
        chain = []
        for p in sequence:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], p) <= 0:
                chain.pop()
            chain.append(p)
        chains += chain[:-1]
    return np.array(chains)


def _turn(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def distance(corners, points) -> np.ndarray:
    """Signed distance of points (..., 2) to convex polygons (..., v, 2), negative inside; repeated corners allowed."""
    a, b = corners, np.roll(corners, -1, axis=-2)
    edge, offset = b - a, points[..., None, :] - a
    length2 = (edge**2).sum(-1)
    share = np.clip((offset * edge).sum(-1) / np.where(length2 > 0, length2, 1), 0, 1)
    nearest = np.sqrt(((offset - share[..., None] * edge) ** 2).sum(-1)).min(-1)
    outward = offset[..., 0] * edge[..., 1] - offset[..., 1] * edge[..., 0]
    outward = np.where(length2 > 0, outward / np.sqrt(np.where(length2 > 0, length2, 1)), -np.inf)
    beyond = outward.max(-1)
    area = (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]).sum(-1)
    return np.where((beyond > 0) | (area < 1e-12), nearest, beyond)  # a point or a wall has no inside


def grown_corners(obstacle, body, errors) -> np.ndarray:
    """(n, v, 2) corners of obstacle + (-body) + box(e) for each e of errors (n, 2), padded by the first corner."""
    base = polygon_corners(obstacle.A, obstacle.b)
    base = (base[:, None] - body[None]).reshape(-1, 2)
    signs = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]], float)
    hulls = [convex_hull((base[:, None] + signs * e).reshape(-1, 2)) for e in errors]
    most = max(len(h) for h in hulls)
    return np.stack([np.concatenate([h, np.broadcast_to(h[:1], (most - len(h), 2))]) for h in hulls])


def smallest_distance(problem, knots, errors, n_points: int = 201) -> tuple[np.ndarray, float]:
    """Smallest sampled distance (b,) of paths (b, T + 1, 2) with widths (T, 2) from all obstacles, body included; and
    how much closer the path may come between two sampled points.
    """
    radius = getattr(problem.body, "radius", 0.0)
    body = getattr(problem.body, "vertices", np.zeros((1, 2)))
    s = np.linspace(0, 1, n_points)[:, None]
    points = knots[:, :-1, None] * (1 - s) + knots[:, 1:, None] * s  # (b, T, n, 2)
    closest = np.full(len(knots), np.inf)
    for obstacle, span in zip(problem.obstacles, problem.steps, strict=True):
        first, last = (0, len(errors) - 1) if span is None else span
        corners = grown_corners(obstacle, body, errors[first : last + 1])
        gap = distance(corners[None, :, None], points[:, first : last + 1]) - radius
        closest = np.minimum(closest, gap.reshape(len(knots), -1).min(axis=1, initial=np.inf))
    return closest, float(np.linalg.norm(np.diff(knots, axis=1), axis=-1).max(initial=0.0)) / (2 * (n_points - 1))


def row_room(problem, knots, q, final) -> np.ndarray:
    """Smallest room (b,) of goal rows, shrunken by the final widths, and start rows, per unit of |row|_1."""
    end = np.concatenate([knots[:, -1], q], axis=1)
    goal = problem.goal
    size = np.abs(goal.A).sum(axis=1)
    room = ((goal.b - np.abs(goal.A) @ final - end @ goal.A.T) / size).min(axis=1)
    if problem.start is not None:
        size = np.abs(problem.start.A).sum(axis=1)
        room = np.minimum(room, ((problem.start.b - knots[:, 0] @ problem.start.A.T) / size).min(axis=1))
    return room


def knots_of(net, T: int, p0, k) -> tuple[np.ndarray, np.ndarray]:
    """Predicted knots (b, T + 1, 2) and further states (b, n_q) of plans, in NumPy."""
    h = k
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        h = np.maximum(h @ W.T + b, 0)
    y = h @ net.weights[-1].T + net.biases[-1]
    offsets = np.concatenate([np.zeros((len(k), 1, 2)), y[:, : 2 * T].reshape(-1, T, 2)], axis=1)
    return p0[:, None] + offsets, y[:, 2 * T :]
