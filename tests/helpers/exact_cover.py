"""Cover in exact rationals, sharing nothing with the engine: what of a polygon no piece holds."""

from fractions import Fraction
from itertools import pairwise

Corner = tuple[Fraction, Fraction]


def exact(points) -> list[Corner]:
    return [(Fraction(float(x)), Fraction(float(y))) for x, y in points]


def trapezoids(rings: list[list[Corner]]) -> list[list[Corner]]:
    """Convex parts of what the rings enclose an odd number of times: slabs between the corners."""
    edges = [e for ring in rings for e in zip(ring, ring[1:] + ring[:1], strict=True)]
    edges = [(min(a, b), max(a, b)) for a, b in edges if a[0] != b[0]]
    xs = sorted({x for ring in rings for x, _ in ring})
    found = []
    for left, right in pairwise(xs):
        across = [e for e in edges if e[0][0] <= left and e[1][0] >= right]
        across.sort(key=lambda e: at(e, left) + at(e, right))
        for low, high in zip(across[::2], across[1::2], strict=True):
            ends = [(left, at(low, left)), (right, at(low, right))]
            ends += [(right, at(high, right)), (left, at(high, left))]
            found.append(ends)
    return found


def at(edge, x: Fraction) -> Fraction:
    (a, b), (c, d) = edge
    return b + (d - b) * (x - a) / (c - a)


def size(ring: list[Corner]) -> Fraction:
    """Twice the area, with its sign."""
    pairs = zip(ring, ring[1:] + ring[:1], strict=True)
    return sum((x * v - u * y for (x, y), (u, v) in pairs), Fraction(0))


def cut(ring: list[Corner], a: Corner, b: Fraction) -> list[Corner]:
    """The part of a convex ring where a.x <= b."""
    out = []
    for p, q in zip(ring, ring[1:] + ring[:1], strict=True):
        here, there = (a[0] * z[0] + a[1] * z[1] - b for z in (p, q))
        if here <= 0:
            out.append(p)
        if here * there < 0:
            share = here / (here - there)
            out.append((p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])))
    return out


def rows(piece) -> list[tuple[Corner, Fraction]]:
    return [(exact([a])[0], Fraction(float(b))) for a, b in zip(piece.A, piece.b, strict=True)]


def left_over(parts: list[list[Corner]], pieces) -> list[list[Corner]]:
    """Convex parts with an area that none of the pieces {A x <= b} holds."""
    for piece in pieces:
        outside = []
        for rest in parts:
            for a, b in rows(piece):
                beyond = cut(rest, (-a[0], -a[1]), -b)
                if len(beyond) > 2 and size(beyond):
                    outside.append(beyond)
                rest = cut(rest, a, b)
                if len(rest) < 3:
                    break
        parts = outside
    return parts


def meets(piece, p: Corner, q: Corner) -> bool:
    """Does the segment from p to q meet the piece?"""
    low, high = Fraction(0), Fraction(1)
    for a, b in rows(piece):
        here, there = (a[0] * z[0] + a[1] * z[1] - b for z in (p, q))
        if here == there:
            if here > 0:
                return False
        elif here < there:
            high = min(high, here / (here - there))
        else:
            low = max(low, here / (here - there))
    return low <= high
