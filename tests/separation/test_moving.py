"""Moving obstacles: every place the obstacle takes during an interval is inside the polytope of
that interval.
"""

import numpy as np
import pytest
from toy_models import random_polygon

from parc_jax.common.errors import InputError
from parc_jax.common.said import without_braces
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, from_box, hpolytope
from parc_jax.common.sets.rational import area, rational_vertices
from parc_jax.learning.system import time_grid
from parc_jax.problem.problem import reach_avoid
from parc_jax.problem.world.moving import moving
from parc_jax.statement import about_obstacles

DT = 0.1


@pytest.mark.soundness
@pytest.mark.parametrize("every", [1, 4])
def test_every_place_is_covered_and_little_else(rng, every):
    for _ in range(10):
        poly, v = random_polygon(rng, rng.normal(size=2), 0.5), rng.normal(size=2)
        parts, spans = moving(poly, v, (3, 12), DT, every=every)
        assert [t for a, b in spans for t in range(a, b + 1)] == list(range(3, 13))
        corners = np.array(rational_vertices(poly), float)
        for part, (first, last) in zip(parts, spans, strict=True):
            times = np.linspace(first * DT, (last + 1) * DT, 17)
            places = corners[None] + times[:, None, None] * v[None, None]
            assert (places @ part.A.T <= part.b + 1e-12).all()
            way = (last + 1 - first) * DT * np.hypot(*v)
            across = np.ptp(corners @ [-v[1], v[0]]) / np.hypot(*v)
            exact = float(area(rational_vertices(poly))) + way * across
            assert float(area(rational_vertices(part))) == pytest.approx(exact, rel=1e-7)


@pytest.mark.soundness
def test_a_velocity_that_is_off_by_a_bound_stays_inside_and_no_bound_is_wasted(rng):
    for n in (2, 3):
        poly = from_box(box(np.zeros(n), rng.uniform(0.1, 1, n)))
        v, off_by = rng.normal(size=n), 0.7
        parts, spans = moving(poly, v, (3, 12), DT, every=4, off_by=off_by)
        corners = np.array(rational_vertices(poly), float)
        ways = rng.normal(size=(200, n))
        ways *= off_by / np.linalg.norm(ways, axis=1, keepdims=True)
        for part, (first, last) in zip(parts, spans, strict=True):
            times = np.linspace(first * DT, (last + 1) * DT, 5)
            moved = corners[None, :, None] + times[:, None, None, None] * (v + ways)
            inside = moved.reshape(-1, n) @ part.A.T <= part.b + 1e-12
            assert inside.all()
            # each side is met by who moves straight at it
            ahead = part.A / np.linalg.norm(part.A, axis=1, keepdims=True)
            ends = corners[None] + times[[0, -1], None, None] * v
            far = np.einsum("rn,ecn->rec", part.A, ends).max(axis=2)
            far = far + off_by * np.einsum("rn,rn->r", part.A, ahead)[:, None] * times[[0, -1]]
            assert part.b == pytest.approx(far.max(axis=1), abs=1e-8)


def test_what_moves_says_how_surely_its_places_are_known_and_that_they_are_more():
    """So that "no plan is safe" is of these places, in whose way nobody need ever be."""
    post = box([3.0, -0.5], [3.4, 0.5])
    parts, spans = moving(post, [0.1, 0.0], (0, 3), DT, every=2, off_by=0.25)
    said = (
        "Who moves stands as told when a plan begins, is within {0.25} m/s of the velocity told, "
        "and told of as all of its places in 2 intervals."
    )
    timed = moving(post, [0.1, 0.0], (0, 3), DT, at=7.0, every=2, off_by=0.25)[1]
    assert timed[0].said == said.replace("stands as told when a plan begins, ", "")
    asked = reach_avoid(box([2.9, -0.1, -9.0], [3.5, 0.1, 9.0]), parts, 0.2, spans=spans)
    assert [span.said for span in spans] == [said] * 2
    assert about_obstacles(asked, time_grid(DT, 4 * DT, DT)).endswith(
        f"Of at most 1 at a time: {without_braces(said)}"
    )
    assert not any(span.said for span in moving(post, [0.0, 0.0], (0, 3), DT, every=2)[1])


def bodies_in_space():
    """A box, a pyramid, a wall, a rod and a point."""
    return [
        box([0, 0, 0], [0.4, 0.3, 0.2]),
        hpolytope(
            [[1, 0, 1], [-1, 0.3, 1], [0, 1, 1], [0.2, -1, 1], [0, 0.1, -1]],
            [0.4, 0.5, 0.4, 0.5, 0.1],
        ),
        box([0, 0, 0], [0, 0.3, 0.2]),
        box([0, 0, 0], [0, 0, 0.2]),
        box([1, 2, 3], [1, 2, 3]),
    ]


@pytest.mark.soundness
@pytest.mark.parametrize("v", [[1.0, 0, 0], [1, 1, 0], [0, 0, -2], [0.3, -1.1, 0.7]])
@pytest.mark.parametrize("body", range(5))
def test_in_space_every_place_is_covered_and_nothing_else(v, body):
    obstacle = bodies_in_space()[body]
    poly = obstacle if isinstance(obstacle, HPolytope) else from_box(obstacle)
    corners = np.array(rational_vertices(poly), float)
    parts, spans = moving(obstacle, v, (2, 9), DT, every=4)
    rng = np.random.default_rng(0)
    for part, (first, last) in zip(parts, spans, strict=True):
        ends = np.array([first * DT, (last + 1) * DT])
        places = (corners[None] + np.linspace(*ends, 9)[:, None, None] * np.array(v)).reshape(-1, 3)
        assert (places @ part.A.T <= part.b + 1e-12 * np.abs(part.A).sum(axis=1)).all()
        hull = (corners[None] + ends[:, None, None] * np.array(v)).reshape(-1, 3)
        around = np.array(rational_vertices(part), float)
        for w in rng.normal(size=(50, 3)):
            assert (around @ w).max() == pytest.approx((hull @ w).max(), abs=1e-7)


def test_standing_still_and_bad_input():
    parts, spans = moving(box([0, 0], [1, 1]), [0.0, 0.0], (0, 5), DT, every=10)
    assert spans == [(0, 5)] and np.allclose(parts[0].b, [1, 1, 0, 0])
    with pytest.raises(InputError, match="moving"):
        moving(box([0, 0], [1, 1]), [1.0, 0.0], (5, 2), DT)
    for off_by in (-0.1, np.nan, np.inf):
        with pytest.raises(InputError, match=r"off_by of 0 m/s or more|off_by: expected finite"):
            moving(box([0, 0], [1, 1]), [1.0, 0.0], (0, 2), DT, off_by=off_by)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"span": (0, 1.5)}, "moving last: expected a whole number >= 0; got 1.5"),
        ({"span": (0, True)}, "moving last: expected a whole number >= 0; got True"),
        ({"span": (-1, 2)}, "moving first: expected a whole number >= 0; got -1"),
        ({"span": 3}, r"moving: expected span = \(first, last\); got 3"),
        ({"every": 1.5}, "moving every: expected a whole number >= 1; got 1.5"),
        ({"dt": np.inf}, "moving dt: expected finite numbers"),
        ({"dt": 0.0}, "moving: expected .* dt > 0"),
        ({"off_by": "1.0x"}, "off_by: expected numbers"),
        ({"obstacle": HPolytope(np.eye(2), np.full(2, np.nan))}, "moving: polytope b: expected"),
    ],
    ids=str,
)
def test_what_moves_nowhere_is_refused_in_a_sentence(wrong, said):
    told = {"obstacle": box([0, 0], [1, 1]), "velocity": [0.1, 0.0], "span": (0, 2), "dt": DT}
    with pytest.raises(InputError, match=said):
        moving(**told | wrong)
