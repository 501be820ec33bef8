"""A second opinion on plans in NumPy: 201 points of every segment against obstacle + (-body) +
box(e), many at once.

Shares no code with the engine. Corners come from all pairs of rows, the sum with body and error box
from its side normals, distances from every edge. Good for plans whose margins are far above 1e-8.
"""

import numpy as np

DEPTH = 1e-8  # [m] far above the rounding of these scenes


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
    """Signed distance of points (..., 2) to convex polygons (..., v, 2), negative inside; repeated
    corners allowed.
    """
    nearest, beyond = np.inf, -np.inf
    px, py = points[..., 0], points[..., 1]
    area = 0.0
    for i in range(corners.shape[-2]):
        ax, ay = corners[..., i - 1, 0], corners[..., i - 1, 1]
        ex, ey = corners[..., i, 0] - ax, corners[..., i, 1] - ay
        area = area + ax * (ay + ey) - ay * (ax + ex)
        length2 = ex * ex + ey * ey
        length2 = np.where(length2 > 0, length2, 1)
        x, y = px - ax, py - ay
        share = np.clip((x * ex + y * ey) / length2, 0, 1)
        nearest = np.minimum(nearest, (x - share * ex) ** 2 + (y - share * ey) ** 2)
        outward = np.where((ex != 0) | (ey != 0), x * ey - y * ex, -np.inf)
        beyond = np.maximum(beyond, outward / np.sqrt(length2))
    return np.where(
        (beyond > 0) | (area < 1e-12), np.sqrt(nearest), beyond
    )  # a point or a wall has no inside


def grown_corners(obstacle, body, errors) -> np.ndarray:
    """Corners (..., v, 2) of obstacle + (-body) + box(e) for errors e (..., 2): neighbouring sides,
    intersected.

    The sides of a sum of convex sets have the normals of the parts' sides, whatever the sizes.
    """
    base = polygon_corners(obstacle.A, obstacle.b)
    base = convex_hull((base[:, None] - body[None]).reshape(-1, 2))
    edge = np.roll(base, -1, axis=0) - base
    length = np.linalg.norm(edge, axis=1, keepdims=True)
    sides = (np.stack([edge[:, 1], -edge[:, 0]], axis=1) / np.where(length > 0, length, 1))[
        length[:, 0] > 0
    ]
    axes = np.array([[1.0, 0], [0, 1], [-1, 0], [0, -1]])
    new = [n for n in sides if (np.abs(axes - n).max(axis=1) > 1e-9).all()]
    n = np.concatenate([axes, np.reshape(new, (-1, 2))])
    n = n[np.argsort(np.arctan2(n[:, 1], n[:, 0]))]
    support = (base @ n.T).max(axis=0) + np.asarray(errors) @ np.abs(n).T  # (..., v)
    m, other = np.roll(n, -1, axis=0), np.roll(support, -1, axis=-1)
    det = n[:, 0] * m[:, 1] - n[:, 1] * m[:, 0]
    x = (support * m[:, 1] - other * n[:, 1]) / det
    y = (n[:, 0] * other - m[:, 0] * support) / det
    return np.stack([x, y], axis=-1)


def smallest_distance(problem, knots, errors, n_points: int = 201) -> tuple[np.ndarray, np.ndarray]:
    """Smallest sampled distance (b,) of paths (b, T + 1, 2) with widths (b, T, 2) from all
    obstacles, body included; and by how much (b,) the path may come closer between two sampled
    points.
    """
    radius = getattr(problem.body, "radius", 0.0)
    body = getattr(problem.body, "vertices", np.zeros((1, 2)))
    s = np.linspace(0, 1, n_points)[:, None]
    points = knots[:, :-1, None] * (1 - s) + knots[:, 1:, None] * s  # (b, T, n, 2)
    closest = np.full(len(knots), np.inf)
    for obstacle, span in zip(problem.obstacles, problem.spans, strict=True):
        t = slice(0, None) if span is None else slice(span[0], span[1] + 1)
        corners = grown_corners(obstacle, body, errors[:, t])
        gap = distance(corners[:, :, None], points[:, t]) - radius
        closest = np.minimum(closest, gap.reshape(len(knots), -1).min(axis=1, initial=np.inf))
    stride = np.linalg.norm(np.diff(knots, axis=1), axis=-1).max(axis=1, initial=0.0) / (
        n_points - 1
    )
    return closest, stride / 2


def row_room(problem, knots, q, final) -> np.ndarray:
    """Smallest room (b,) per unit of |row|_1: goal rows, shrunken by final (b, n_p + n_q), and
    start rows.
    """
    end = np.concatenate([knots[:, -1], q], axis=1)
    goal = problem.goal
    size = np.abs(goal.A).sum(axis=1)
    room = ((goal.b - final @ np.abs(goal.A).T - end @ goal.A.T) / size).min(axis=1)
    if problem.start is not None:
        size = np.abs(problem.start.A).sum(axis=1)
        room = np.minimum(
            room, ((problem.start.b - knots[:, 0] @ problem.start.A.T) / size).min(axis=1)
        )
    return room


def knots_of(net, T: int, p0, k) -> tuple[np.ndarray, np.ndarray]:
    """Predicted knots (b, T + 1, 2) and further states (b, n_q) of plans, in NumPy."""
    h = k
    for W, b in zip(net.weights[:-1], net.biases[:-1], strict=True):
        h = np.maximum(h @ W.T + b, 0)
    y = h @ net.weights[-1].T + net.biases[-1]
    offsets = np.concatenate([np.zeros((len(k), 1, 2)), y[:, : 2 * T].reshape(-1, T, 2)], axis=1)
    return p0[:, None] + offsets, y[:, 2 * T :]
