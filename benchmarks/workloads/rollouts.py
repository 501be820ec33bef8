"""Simulated runs per second, whole batches, results on the device; compile time apart.

`ode` is the closed-form plant, `mjx` the same body through MuJoCo XLA (on a CPU in one batch size
only: it compiles long). Drift parking: 780 steps of 10 ms with the controller inside; the boat: 10
    s with its neural policy.
"""

import jax
import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import metric, rate
from benchmarks.result import Result, Table, milliseconds
from benchmarks.timing import timed
from parc_jax.common.keys import Stage
from parc_jax.learning.runs.collect import simulate_rows

BATCHES = {
    ("cpu", "ode"): (1, 256, 2048),
    ("cpu", "mjx"): (256,),
    ("gpu", "ode"): (1, 256, 4096, 65_536),
    ("gpu", "mjx"): (256, 4096),
}


def run(bench: Bench) -> Result:
    """Time every plant at every batch size."""
    import sims

    metrics, rows = [], []
    for system_name in bench.size(("drift_parking", "asv"), ("asv",)):
        for plant in bench.size(("ode", "mjx"), ("ode",)):
            system = sims.load(system_name, plant=plant)
            for batch in bench.size(BATCHES[bench.platform, plant], (16,)):
                numbers = np.arange(batch)

                def call(system=system, numbers=numbers):
                    return jax.tree.leaves(
                        simulate_rows(system, bench.key(), Stage.TRAIN, numbers)[1]
                    )

                done, key = timed(call, bench.size(3, 1)), f"rollouts.{system_name}.{plant}.{batch}"
                finite = float(np.isfinite(np.asarray(done.result[0])).all(axis=(1, 2)).mean())
                metrics += [
                    rate(f"{key}.rate", batch, done.warm, batch=batch),
                    metric(
                        f"{key}.compile",
                        done.compile_s,
                        "s",
                        "lower",
                        rel_tol=1.0,
                        abs_tol=1.0,
                        batch=batch,
                    ),
                    metric(f"{key}.finite", finite, "1", "higher", abs_tol=0.01, batch=batch),
                ]
                per_second = batch / np.median(done.warm)
                rows.append(
                    (
                        system_name,
                        plant,
                        f"{batch:,}",
                        f"{per_second:,.0f}",
                        milliseconds(done.compile_s),
                    )
                )
    header = ("system", "plant", "batch", "runs per second", "compile")
    return Result(metrics, [Table("Rollouts", header, rows)])
