"""Work of whole enumerations, proof included: signs and rationals it takes, function calls. Prints
a table of them, with CPU times, which no assertion depends on:

OPENBLAS_NUM_THREADS=1 pytest -m night -s tests/pwa/test_speed.py

Columns: network, regions, smallest and median time [ms], time of unpacking the vertices [ms], gap,
    signs, rationals.
"""

import time
from itertools import pairwise

import numpy as np
import pytest
from effort import as_installed, calls_of
from region_networks import reference_network, unit_box

from parc_jax.learning.network.relu import relu_network
from parc_jax.proof.regions import enumerate_regions

pytestmark = pytest.mark.night

PUBLISHED = [  # name, function calls allowed
    ("vanderpol_2_20_20", 20_000),
    ("neuralparc_boat_3_8x4", 30_000),
    ("bunny_3_16x3", 45_000),
    ("vcas_3_20x5", 75_000),
    ("double_pendulum_4_25_25", 50_000),
]
RANDOM = [  # inputs, widths, seed, function calls allowed
    (3, (16, 16, 16, 16), 0, 45_000),
    (3, (32, 32, 32), 5, 80_000),
    (2, (64, 64, 64), 0, 130_000),
    (5, (12, 12), 0, 80_000),
    (6, (8, 8, 8), 0, 250_000),
]
SIGNS = 100  # of vertices that may be decided for each region
EXACT = 10  # vertices that may be computed in rationals


def he_network(n, widths, seed, out=157):
    rng, sizes = np.random.default_rng(seed), [n, *widths, out]
    weights = [rng.normal(size=(b, a)) * np.sqrt(2 / a) for a, b in pairwise(sizes)]
    return relu_network(weights, [0.3 * rng.normal(size=b) for b in sizes[1:]])


def measure(name, net, domain, allowed, repeats=5):
    """The table of regions, found by little work; prints a line of the page's table."""
    seconds = []
    with as_installed():
        for _ in range(repeats):
            start = time.process_time()
            table = enumerate_regions(net, domain)
            seconds.append(time.process_time() - start)
        start = time.process_time()
        _ = table.points[table.face_vertices(net.n_in)[0]]
        vertices = time.process_time() - start
    proof = table.proof
    times = " | ".join(f"{1e3 * t:.3g}" for t in (min(seconds), np.median(seconds), vertices))
    print(
        f"\n| {name} | {table.count:,} | {times} | {proof.gap:.0e} | {proof.n_signs:,} | "
        f"{proof.n_exact} |",
        end="",
    )
    # all regions at once: a loop over them would be millions of calls
    assert calls_of(lambda: enumerate_regions(net, domain)) <= allowed
    assert proof.n_signs <= SIGNS * table.count and proof.n_exact <= EXACT
    return table


@pytest.mark.parametrize(("name", "allowed"), PUBLISHED)
def test_published_networks(shared_data, name, allowed):
    net, domain, count = reference_network(shared_data, name)
    assert measure(name, net, domain, allowed).count == count


@pytest.mark.parametrize(("n", "widths", "seed", "allowed"), RANDOM)
def test_random_networks(n, widths, seed, allowed):
    name = f"random {n}-{'-'.join(map(str, widths))}"
    measure(name, he_network(n, widths, seed), unit_box(n), allowed, repeats=5 if n < 5 else 2)
