"""Where drawn triangles are."""

import numpy as np


def covered(points, shapes):
    """(n,) is a point (n, 2) in one of the triangles?"""
    corners = shapes[None]
    sides = np.roll(corners, -1, axis=2) - corners
    off = points[:, None, None] - corners
    turn = sides[..., 0] * off[..., 1] - sides[..., 1] * off[..., 0]
    same = (turn >= -1e-9).all(axis=2) | (turn <= 1e-9).all(axis=2)
    return same.any(axis=1)
