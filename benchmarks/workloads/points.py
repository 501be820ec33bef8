"""Exact verdicts on single points (p0, k) per second: goal with margin, and every segment against
every obstacle.

Points are drawn so that their end lies in the goal's box, as a query draws them. The verdict is the
float64 one whose margin covers all rounding. Counts of reaching and safe points are gated: same
key, same points, same verdicts.
"""

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import metric, rate
from benchmarks.result import Result
from benchmarks.timing import timed
from parc_jax.safe_set.verdict.pointwise import CHUNK, anchor, verdicts
from parc_jax.safe_set.verdict.scene import scene_of


def run(bench: Bench) -> Result:
    """Anchor and evaluate one large batch."""
    case, model = bench.model()
    scene, rng, n = (
        scene_of(case.problem(), model),
        np.random.default_rng(0),
        bench.size(1 << 17, 1 << 11),
    )
    k = rng.uniform(model.domain.lo, model.domain.hi, (n, model.n_k))
    z = rng.uniform(scene.z_lo, scene.z_hi, (n, model.n_p))
    p0, reaches = anchor(scene, z, k)
    done = timed(lambda: verdicts(scene, p0, k), bench.size(5, 1))
    return Result(
        [
            rate("points.rate", n, done.warm, batch=CHUNK),
            metric("points.compile", done.compile_s, "s", "lower", rel_tol=1.0, abs_tol=0.5),
            metric("points.reaching", reaches.mean(), "1", "same", abs_tol=1e-4),
            metric("points.safe", done.result.safe.mean(), "1", "same", abs_tol=1e-4),
        ]
    )
