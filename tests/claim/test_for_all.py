"""Covers of K: never below the true maximum, near it when fine, and refused where they do not
apply.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from synthetic_plants import exact, noisy, plant, straight, straight_network

from parc_jax.claim.for_all import Curvature, Lipschitz, curvature_cover, lipschitz_cover
from parc_jax.claim.risk import Point
from parc_jax.claim.simplices import triangulate
from parc_jax.errors import InputError, SoundnessError
from parc_jax.network.relu import relu_network
from parc_jax.sets.box import box

KEY, NET = jax.random.PRNGKey(0), straight_network(4)
C = NET.weights[0][None]
SQUARE = [np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])]
pytestmark = pytest.mark.soundness


def wavy(key, k, s):
    """Error 0.1 sin(8 k_0) s: slope 0.8, curvature 6.4, maximum exactly 0.1."""
    p, q = straight(k, s)
    return p + 0.1 * jnp.sin(8 * k[:1])[None] * s[:, None], q


CONSTANTS = Lipschitz(np.array([[1.8, 0.0], [0.8, 1.0]]), [[1.0, 0.0]])


def test_a_lipschitz_cover_bounds_the_true_maximum():
    system, tight = plant(wavy), []
    for cells in ((8, 2), (64, 2), (512, 2)):
        claim = lipschitz_cover(NET, system, KEY, CONSTANTS, C, cells, quiet=True)
        width = claim.tube.interval[0, -1, 0]
        assert width >= 0.1
        tight.append(width - 0.1)
    assert tight[0] > tight[1] > tight[2] and claim.n == 1024
    assert (
        claim.kind == "cover"
        and "LIPSCHITZ" in claim.statement()
        and claim.risk(Point()).bound == 0
    )


def test_a_lipschitz_cover_by_bins():
    claim = lipschitz_cover(NET, plant(wavy), KEY, CONSTANTS, C, (256, 8), bins=(4, 2), quiet=True)
    k = np.linspace(0, 1, 4001)
    for number in range(8):
        lo, hi = claim.tube.bin_box(number)
        inside = (k >= lo[0]) & (k <= hi[0])
        assert claim.tube.interval[number, -1, 0] >= np.abs(0.1 * np.sin(8 * k[inside])).max()
    assert claim.tube.interval[:2, -1, 0].max() > 0.1 > claim.tube.interval[2:4, 0, 0].max()
    with pytest.raises(InputError, match="multiple of the bins"):
        lipschitz_cover(NET, plant(wavy), KEY, CONSTANTS, C, (10, 8), bins=(4, 2), quiet=True)


def test_a_curvature_cover_bounds_the_true_maximum_with_fewer_runs():
    system = plant(wavy)
    fine = curvature_cover(NET, system, KEY, Curvature(6.4), SQUARE, 0.05, bins=(4, 1), quiet=True)
    coarse = curvature_cover(NET, system, KEY, Curvature(6.4), SQUARE, 0.3, bins=(4, 1), quiet=True)
    assert 0.1 <= fine.tube.interval[0, -1, 0] < 0.104 < coarse.tube.interval[0, -1, 0]
    assert "CURVATURE" in fine.statement() and coarse.n < fine.n < 2000


def test_curvature_covers_follow_the_regions_of_the_network():
    kinked = relu_network(
        [np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([[1.0, 1.0]] * 9)],
        [np.array([-0.5, 0.5]), np.zeros(9)],
    )  # every output |k_0 - 1/2|
    halves = [
        np.array([[0.0, 0.0], [0.5, 0.0], [0.5, 1.0], [0.0, 1.0]]),
        np.array([[0.5, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, 1.0]]),
    ]

    def triangle(key, k, s):
        return jnp.zeros((len(s), 2), k.dtype), jnp.zeros(1, k.dtype)

    claim = curvature_cover(kinked, plant(triangle), KEY, Curvature(0.0), halves, 2.0, quiet=True)
    np.testing.assert_allclose(claim.tube.final, 0.5, atol=1e-8)  # |k - 1/2| at the ends of K
    assert claim.n == 6


def test_systems_with_a_disturbance_are_refused():
    with pytest.raises(InputError, match="without disturbance"):
        lipschitz_cover(NET, plant(noisy), KEY, CONSTANTS, C, (4, 4), quiet=True)


def test_regions_with_a_hole_are_refused():
    with pytest.raises(SoundnessError, match="fill"):
        curvature_cover(
            NET, plant(exact), KEY, Curvature(0.0), [SQUARE[0] * [0.999, 1]], 1.0, quiet=True
        )


@pytest.mark.parametrize("n", [1, 2, 3])
def test_simplices_fill_k_share_vertices_and_are_small(n):
    corners = np.stack(np.meshgrid(*[[0.0, 2.0]] * n, indexing="ij"), axis=-1).reshape(-1, n)
    mesh = triangulate([corners], box(np.zeros(n), np.full(n, 2.0)), 0.5)
    simplices = mesh.points[mesh.corners]
    volume = np.abs(np.linalg.det(simplices[:, 1:] - simplices[:, :1])).sum() / np.prod(
        np.arange(1, n + 1)
    )
    assert abs(volume - 2.0**n) < 1e-12 and mesh.longest.max() <= 0.5 * 2.0 + 1e-12
    assert len(np.unique(mesh.points, axis=0)) == len(mesh.points) < mesh.corners.size
