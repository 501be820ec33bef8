"""Training one 4x8 network on the drift rollouts: float32 features, float64 last layer in closed
form.

Time per seed and step, compile time apart. What matters for the tube is the tail of the held-out
error, which is gated too (loosely: it depends on the order of float32 sums).
"""

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import metric, times
from benchmarks.result import Result
from benchmarks.timing import timed
from parc_jax.learning.network.relu import outputs
from parc_jax.learning.network.train import HELD, tail_of, train, training_arrays


def run(bench: Bench) -> Result:
    """Train the same network several times."""
    name = bench.size("drift", "boat")
    data, seeds, steps = bench.learned(name).train, bench.size(2, 1), bench.size(1000, 20)
    done = timed(
        lambda: train(data, (8, 8, 8, 8), key=bench.key(1), seeds=seeds, steps=steps),
        bench.size(3, 1),
    )
    net, (k, y) = done.result, training_arrays(data)
    held = slice(round(len(k) * (1 - HELD)), None)
    rms = np.sqrt(((outputs(net, k[held]) - y[held]) ** 2).mean())
    return Result(
        [
            *times(
                "training.per_seed_and_step",
                done.warm / (seeds * steps),
                batch=1000,
                dtype="float32",
            ),
            metric(
                "training.compile",
                done.compile_s,
                "s",
                "lower",
                rel_tol=1.0,
                abs_tol=1.0,
                dtype="float32",
            ),
            metric("training.tail", tail_of(net, k[held], y[held]), "m", "lower", rel_tol=0.3),
            metric("training.rms", rms, "m", "lower", rel_tol=0.3),
        ]
    )
