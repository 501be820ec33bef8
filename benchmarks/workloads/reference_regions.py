"""All linear regions of networks that others trained and counted.

The counts must be theirs exactly, and the volumes must add up to the box. Skipped where the
networks are not at hand.
"""

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import exact, metric, times
from benchmarks.result import Result, Skip, Table, milliseconds
from benchmarks.timing import seconds_of
from parc_jax.common.sets.box import box
from parc_jax.learning.network.relu import relu_network
from parc_jax.proof.regions import enumerate_regions


def run(bench: Bench) -> Result:
    """Enumerate each reference network several times."""
    files = sorted(bench.reference.glob("*.npz")) if bench.reference.is_dir() else []
    if not files:
        raise Skip("the reference networks are not at hand")
    metrics, rows = [], []
    for file in files:
        with np.load(file) as z:
            layers = range(sum(name.startswith("W") for name in z.files))
            net = relu_network([z[f"W{i}"] for i in layers], [z[f"b{i}"] for i in layers])
            domain, counted = box(z["lo"], z["hi"]), int(z["regions"])
        seconds, table = seconds_of(
            lambda net=net, domain=domain: enumerate_regions(net, domain), bench.size(7, 1)
        )
        name, lost = file.stem, abs(table.volumes.sum() / domain.volume - 1)
        metrics += [
            exact(f"reference_regions.{name}.off_by", table.count - counted),
            metric(f"reference_regions.{name}.volume_lost", lost, "1", "lower", abs_tol=1e-12),
            *times(f"reference_regions.{name}", seconds),
        ]
        rows.append(
            (
                name,
                f"{counted:,}",
                f"{table.count:,}",
                f"{lost:.0e}",
                milliseconds(np.median(seconds)),
            )
        )
    header = ("network", "counted elsewhere", "found", "volume missing", "median")
    return Result(metrics, [Table("Reference networks", header, rows)])
