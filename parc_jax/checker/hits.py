"""Hits: boxes of plans in which a part of the body is in contact with one obstacle at one moment,
with errors that every bin allows. [T30, T35]
"""

from fractions import Fraction

from .errors import Widths
from .exact import FRACTION, array, dot, need, number, vector, whole
from .plans import condition


def shape_point(context, part, spelled):
    """A point of a part's shape: its coordinates in a disc, or weights of a polygon's vertices."""
    if part.vertices is None:
        point = vector(spelled, context.n_p)
        need(dot(point, point) <= part.radius**2, "a contact's body point is outside the disc")
        return point
    weights = vector(spelled, len(part.vertices))
    check_weights(weights)
    return [dot(weights, column) for column in zip(*part.vertices, strict=True)]


def check_weights(weights):
    """Are these the weights of a mixture?"""
    need(all(v >= 0 for v in weights), "a weight of a contact is negative")
    need(sum(weights) == 1, "the weights of a contact do not sum to one")


class Contact:
    """A contact [body, errors]: a point of a part's shape, and one error for each of its points."""

    def __init__(self, context, part, entry):
        spelled, errors = entry
        self.body = shape_point(context, part, spelled)
        self.errors = [vector(error, context.n_p) for error in array(errors, len(part.points))]

    def offset(self, weights):
        """How far it is from the mixture of the points."""
        offset = self.body
        for weight, error in zip(weights, self.errors, strict=True):
            offset = [x + weight * y for x, y in zip(offset, error, strict=True)]
        return offset

    def fits(self, context, part, by_point):
        """Whether its errors are among these, of each point of the robot."""
        cost = sum(by_point[i].cost for i in part.points)
        context.spend(FRACTION * context.n_p * len(part.points) + cost)
        pairs = zip(part.points, self.errors, strict=True)
        return all(by_point[i].contains(error) for i, error in pairs)


def fits_knot(context, part, contact, bins, s):
    """Whether every bin allows the errors of a contact at knot s: in both intervals that have it,
    and at the end, which has to have half widths.
    """
    n = context.n_p
    for b in bins:
        near = context.interval[b][max(s - 1, 0) : s + 1]
        if s == context.T:
            final = context.final[b]
            if not final.is_box:
                return False
            own = [final.e[i * n : (i + 1) * n] for i in range(context.n_points)]
            near = [*near, [Widths(e, final.scale) for e in own]]
        if not all(contact.fits(context, part, by_point) for by_point in near):
            return False
    return True


def only_touch(context, part, contacts, bins, t, alpha):
    """Whether these contacts at the share alpha of interval t need no more than touch.

    Between knots a trajectory has their errors for a moment. At a knot it may only if they fit the
    intervals on both sides; else it has to be inside the obstacle, where it is a moment later or
    earlier as well. [T30]
    """
    if 0 < alpha < 1:
        return True
    return all(fits_knot(context, part, contact, bins, t + int(alpha)) for contact in contacts)


def hit(context, what, bins):
    """Groups of contacts, each with the conditions on (p0, y) that the mixture of a part's points
    at the share alpha of interval t, and the offset of the contact, are together in the obstacle:
    a list of lists of lists. A group has one mixture.
    """
    o, which, t, alpha, groups = what
    whole(o, 0, len(context.obstacles) - 1)
    rows, first, last = context.obstacles[o]
    part = context.parts[whole(which, 0, len(context.parts) - 1)]
    whole(t, first, last)
    alpha = number(alpha)
    need(0 <= alpha <= 1, "a hit is outside its interval")
    read = []
    for weights, entries in groups:
        weights = vector(weights, len(part.points))
        check_weights(weights)
        read.append((weights, [Contact(context, part, entry) for entry in array(entries)]))
    contacts = [contact for _, some in read for contact in some]
    for contact in contacts:
        inside_tube = all(contact.fits(context, part, context.interval[b][t]) for b in bins)
        need(inside_tube, "the error of a contact is outside the tube")
    strict = not only_touch(context, part, contacts, bins, t, alpha)
    found = []
    for weights, contacts in read:
        moved, outputs = mixture(context, part, weights, t, alpha)
        options = []
        for contact in contacts:
            offset = contact.offset(weights)
            context.spend(FRACTION * len(rows) * (context.n_p + len(moved)))
            inside = []
            for a, b in rows:
                away = [-x for x in a]
                along = [x * away[axis] for axis, x in moved]
                inside.append(condition("", strict, away, along, outputs, b - dot(a, offset)))
            options.append(inside)
        found.append(options)
    return found


def mixture(context, part, weights, t, alpha):
    """A mixture of a part's points at the share alpha of interval t, as p0 plus outputs y: (axis,
    coefficient) of each of the outputs at both knots, and where these are.
    """
    by_point = [Fraction(0)] * context.n_points
    for i, weight in zip(part.points, weights, strict=True):
        by_point[i] += weight
    moved = []
    for share in (1 - alpha, alpha):
        for weight in by_point:
            moved += [(axis, share * weight) for axis in range(context.n_p)]
    end = context.offset(t + 1, context.n_points - 1).stop
    if t == 0:  # point 0 at knot 0 is p0, and no output
        moved = moved[context.n_p :]
    return moved, slice(end - len(moved), end)
