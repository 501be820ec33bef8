"""Bodies: parts of named points, and what is no body."""

import numpy as np
import pytest

from parc_jax.common.errors import InputError
from parc_jax.problem.body import (
    Body,
    Disc,
    Part,
    Polygon,
    body_of,
    hull,
    numbered,
    parts_of,
    shape,
)

NAMES = ("centre", "left", "right")


def test_every_kind_of_body_has_parts():
    assert parts_of(Disc(0.5)) == (Part((0,), Disc(0.5)),)
    car = hull("left", "right", radius=0.1)
    assert parts_of(car) == (Part(("left", "right"), Disc(0.1)),)
    both = body_of([car, Part((0,), Disc(1.0))])
    assert len(both.parts) == 2 and "left, right" in repr(both)


def test_names_become_numbers():
    parts = numbered(hull("right", 1, "centre"), NAMES)
    assert [part.points for part in parts] == [(2, 1, 0)]
    assert numbered(Disc(1.0), NAMES)[0].points == (0,)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: body_of([]), "at least one part; got none"),
        (lambda: hull(), "at least one reference point; got none"),
        (lambda: hull("left", radius=-1.0), "part 0 of the body radius: expected a number >= 0"),
        (lambda: hull(1.5), "names or numbers of points; got 1.5"),
        (lambda: body_of([Disc(1.0)]), "part 0 of the body: expected Part; got Disc"),
        (lambda: body_of([Part(("left",), "round")]), "part 0 of the body radius"),
        (lambda: numbered(hull("nose"), NAMES), r"\(centre, left, right\); got 'nose'"),
        (lambda: numbered(hull(3), NAMES), "got 3"),
        (lambda: shape("body", Polygon(np.zeros((0, 2)))), "at least one vertex"),
    ],
)
def test_what_is_no_body_is_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        wrong()


def test_a_body_is_validated_once_and_kept():
    body = hull("left", "right")
    assert isinstance(body, Body) and body.parts[0].shape == Disc(0.0)
