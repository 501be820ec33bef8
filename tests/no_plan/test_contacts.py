"""Contacts in space and of mixtures of points, checked in fractions; mixtures against a linear
program.
"""

from fractions import Fraction

import numpy as np
import pytest

from parc_jax.checker import number
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import hpolytope
from parc_jax.problem.body import Disc, Polygon, hull
from parc_jax.problem.problem import reach_avoid
from parc_jax.proof.absence.errors import WithinWidths
from parc_jax.proof.absence.reasons import Contacts, short_weights

SPIKE = np.array([[0.3, 0.0, -0.2], [-0.2, 0.3, 0.1], [-0.1, -0.3, 0.1], [0.0, 0.1, 0.4]])
WEDGE = hpolytope(
    [[1, 2, 0], [-1, -2, 0], [2, -1, 1], [-2, 1, 0], [0, 0, 1], [0, 0, -1]],
    [0.1, 0.1, 1.5, 1.0, 0.5, 0.5],
)


def exact(vector):
    return [number(v) for v in vector]


def inside(poly, x):
    rows = zip(poly.A, poly.b, strict=True)
    return all(
        sum(Fraction(a) * v for a, v in zip(row, x, strict=True)) <= Fraction(b) for row, b in rows
    )


def point_of(shape, spelled):
    """The exact point of a shape that a certificate names; it is one of the shape."""
    given = exact(spelled)
    if isinstance(shape, Disc):
        assert sum(v * v for v in given) <= Fraction(shape.radius) ** 2
        return given
    assert min(given) >= 0 and sum(given) == 1
    return [
        sum(w * Fraction(v[axis]) for w, v in zip(given, shape.vertices, strict=True))
        for axis in range(shape.vertices.shape[1])
    ]


def around(rng, shape, n):
    """Random points of a shape, many near its boundary."""
    if isinstance(shape, Polygon):
        return rng.dirichlet(np.full(len(shape.vertices), 0.3), n) @ shape.vertices
    way = rng.normal(size=(n, 3))
    return shape.radius * way / np.linalg.norm(way, axis=1)[:, None] * rng.uniform(0.5, 1, (n, 1))


@pytest.mark.parametrize("shape", [Disc(0.3), Polygon(SPIKE)])
def test_contacts_in_space_hold_exactly_wherever_the_grown_obstacle_is(rng, shape):
    problem = reach_avoid(box([0, 0, 0, -1], [1, 1, 1, 1]), [WEDGE], shape)
    contacts = Contacts(problem, 0)
    error = np.array([0.05, 0.1, 0.02])
    within = WithinWidths(error[None], np.ones(1))
    corners = contacts.corners
    assert (WEDGE.A @ corners.T <= WEDGE.b[:, None] + 1e-9).all()
    found = rng.dirichlet(np.full(len(corners), 0.3), 60) @ corners
    errors = rng.uniform(-error, error, (60, 3))
    p = found - 0.98 * around(rng, shape, 60) - 0.98 * errors
    for group in np.split(p, 20):
        entries = contacts.find(group, within)
        assert entries is not None
        for place in group:
            hits = []
            for body, (shift,) in entries:
                shift = exact(shift)
                assert all(abs(s) <= Fraction(float(e)) for s, e in zip(shift, error, strict=True))
                offset = zip(place, point_of(shape, body), shift, strict=True)
                hits.append(inside(WEDGE, [Fraction(float(x)) + y + s for x, y, s in offset]))
            assert any(hits)
    assert contacts.find(np.array([[5.0, 5.0, 5.0]]), within) is None


def test_the_errors_of_a_mixture_are_errors_of_its_points(rng):
    """The obstacle is reached only with most of what both points may err."""
    problem = reach_avoid(box([0, 0, -1], [1, 1, 1]), [box([1, -1], [2, 1])], hull(0, 1))
    errors = np.array([[0.1, 0.05], [0.3, 0.0]])
    weights = short_weights(np.array([0.3, 0.7]))
    assert sum(weights) == 1
    mixed = np.array([float(w) for w in weights])
    widest = float(mixed @ errors[:, 0])
    within = WithinWidths(errors, mixed)
    ((body, of_each),) = Contacts(problem, 0).find(np.array([[1.001 - widest, 0.0]]), within)
    assert exact(body) == [0, 0]
    for given, most in zip(of_each, errors, strict=True):
        assert all(abs(x) <= Fraction(float(e)) for x, e in zip(exact(given), most, strict=True))
    total = sum(w * exact(given)[0] for w, given in zip(weights, of_each, strict=True))
    assert total + Fraction(1.001 - widest) >= 1
    assert Contacts(problem, 0).find(np.array([[0.999 - widest, 0]]), within) is None
