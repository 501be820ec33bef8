"""Exact verdicts on single points (p0, k) per second: goal with margin, and every segment against every obstacle.

Points are drawn so that their end lies in the goal's box, as a query draws them. The verdict is the float64 one whose
margin covers all rounding. Counts of reaching and safe points are gated: same key, same points, same verdicts.
"""

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import metric, rate
from benchmarks.result import Result
from benchmarks.timing import timed
from parc_jax.certify.evaluate import CHUNK, anchor, evaluate
from parc_jax.certify.scene import scene


def run(bench: Bench) -> Result:
    """Anchor and evaluate one large batch."""
    case, model = bench.model()
    laid_out, rng, n = scene(case.problem(), model), np.random.default_rng(0), bench.size(1 << 17, 1 << 11)
    k = rng.uniform(model.domain.lo, model.domain.hi, (n, model.n_k))
    z = rng.uniform(laid_out.z_lo, laid_out.z_hi, (n, model.n_p))
    p0, reaches = anchor(model, laid_out, z, k)
    done = timed(lambda: evaluate(model, laid_out, p0, k), bench.size(5, 1))
    return Result(
        [
            rate("points.rate", n, done.warm, batch=CHUNK),
            metric("points.compile", done.compile_s, "s", "lower", rel_tol=1.0, abs_tol=0.5),
            metric("points.reaching", reaches.mean(), "1", "same", abs_tol=1e-4),
            metric("points.safe", done.result.safe.mean(), "1", "same", abs_tol=1e-4),
        ]
    )
