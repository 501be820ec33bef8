"""Corners of vehicles: rigid, where the heading says, and beside an unchanged centre."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from drawn_keys import drawn_keys

import sims
from parc_jax.common.errors import InputError
from parc_jax.problem.body import numbered
from sims import rectangle

KEYS = drawn_keys(1, 3)
SIZES = {"drift_parking": (4.267, 1.988), "asv": (1.3, 0.94), "f110": (0.57, 0.30)}
OPTIONS = {"drift_parking": {"plant": "ode"}, "asv": {"plant": "ode"}, "f110": {}}


def runs_of(system):
    lo, hi = np.asarray(system.domain.lo), np.asarray(system.domain.hi)
    ks = jnp.asarray(lo + (hi - lo) * np.random.default_rng(2).random((3, len(lo))))
    batched = getattr(system, "rollout_batch", None) or jax.jit(jax.vmap(system.rollout))
    return jax.tree.map(np.asarray, batched(KEYS, ks))


SIMULATED = [pytest.param(name, marks=pytest.mark.slow) for name in ("asv", "drift_parking")]


@pytest.fixture(scope="module", params=["f110", *SIMULATED])
def both(request):
    """Name, runs with corners, runs of the centre alone."""
    name = request.param
    with_corners = sims.load(name, body="rectangle", **OPTIONS[name])
    alone = sims.load(name, **OPTIONS[name])
    assert with_corners.points == rectangle.POINTS and alone.points == ("reference",)
    return name, runs_of(with_corners), runs_of(alone)


@pytest.mark.night
def test_the_centre_is_the_one_point_of_before(both):
    _, corners, alone = both
    np.testing.assert_allclose(corners.p[:, :, 0], alone.p, rtol=0, atol=1e-9)
    assert (corners.p[:, 0, 0] == 0).all()
    np.testing.assert_allclose(corners.q, alone.q, rtol=0, atol=1e-9)


@pytest.mark.night
def test_corners_are_those_of_a_rigid_rectangle(both):
    name, runs, _ = both
    length, width = SIZES[name]
    centre, corners = runs.p[:, :, 0], runs.p[:, :, 1:]
    np.testing.assert_allclose(corners.mean(axis=2), centre, atol=1e-12)
    for a, b, apart in ((0, 1, length), (1, 2, width), (2, 3, length), (3, 0, width)):
        side = np.linalg.norm(corners[:, :, a] - corners[:, :, b], axis=-1)
        np.testing.assert_allclose(side, apart, rtol=1e-12)
    diagonal = np.linalg.norm(corners[:, :, 0] - corners[:, :, 2], axis=-1)
    np.testing.assert_allclose(diagonal, np.hypot(length, width), rtol=1e-12)


@pytest.mark.parametrize("name", sorted(SIZES))
def test_the_rectangle_touches_what_the_circle_may_only_come_near(name):
    module = getattr(sims, name)
    disc, true = module.problem(), module.problem(body="rectangle")
    assert disc.body.radius == pytest.approx(np.hypot(*SIZES[name]) / 2)
    (part,) = numbered(true.body, rectangle.POINTS)
    assert part.points == (1, 2, 3, 4) and part.shape.radius == 0
    assert len(true.obstacles) == len(disc.obstacles)
    with pytest.raises(InputError, match="expected one of rectangle, disc"):
        module.problem(body="triangle")
    with pytest.raises(InputError, match="expected one of rectangle, disc"):
        module.system(body="triangle")
