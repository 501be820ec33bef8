"""All linear regions of random networks over a box, with the proof of completeness that every table
carries.

He-normal weights from a fixed seed, so the counts are the same on every machine and are gated
exactly. Times are of one whole enumeration, proof included; there is nothing to compile.
"""

from itertools import pairwise

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import exact, times
from benchmarks.result import Result, Table, milliseconds
from benchmarks.timing import seconds_of
from parc_jax.common.sets.box import box
from parc_jax.learning.network.relu import ReLUNetwork, relu_network
from parc_jax.proof.regions import enumerate_regions

NETWORKS = (
    (2, (8,) * 4),
    (3, (8,) * 4),
    (3, (16,) * 4),
    (2, (64,) * 3),
    (3, (32,) * 3),
    (5, (12,) * 2),
    (6, (8,) * 3),
)


def random_network(n: int, widths: tuple[int, ...], out: int = 157) -> ReLUNetwork:
    """He-normal weights, biases with standard deviation 0.3, seed 0."""
    rng, sizes = np.random.default_rng(0), [n, *widths, out]
    weights = [rng.normal(size=(b, a)) * np.sqrt(2 / a) for a, b in pairwise(sizes)]
    return relu_network(weights, [0.3 * rng.normal(size=b) for b in sizes[1:]])


def run(bench: Bench) -> Result:
    """Enumerate each network several times."""
    metrics, rows = [], []
    for n, widths in bench.size(NETWORKS, NETWORKS[:2]):
        name = f"{n}-" + "-".join(map(str, widths))
        net, domain = random_network(n, widths), box(-np.ones(n), np.ones(n))
        seconds, table = seconds_of(
            lambda net=net, domain=domain: enumerate_regions(net, domain), bench.size(7, 2)
        )
        metrics += [exact(f"regions.{name}.count", table.count), *times(f"regions.{name}", seconds)]
        rows.append(
            (
                name,
                f"{table.count:,}",
                milliseconds(np.median(seconds)),
                milliseconds(seconds.max()),
            )
        )
    return Result(
        metrics, [Table("Random networks", ("network", "regions", "median", "max"), rows)]
    )
