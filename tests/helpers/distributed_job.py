"""One process of so many devices, for test_distributed: rollouts, scores and a batch of problems.

    python distributed_job.py OUT DEVICES

Writes its results to OUT.
"""

import sys

import jax

OUT, DEVICES = sys.argv[1], int(sys.argv[2])
jax.config.update("jax_platforms", "cpu")
jax.config.update("jax_num_cpu_devices", DEVICES)

import numpy as np  # noqa: E402
from scored import score_system  # noqa: E402
from synthetic_plants import noisy, plant, straight_network  # noqa: E402
from toy_models import random_model, rectangle_problem  # noqa: E402

from parc_jax.common import backend  # noqa: E402
from parc_jax.common.keys import Stage  # noqa: E402
from parc_jax.learning.bound.tube import tube  # noqa: E402
from parc_jax.learning.runs import collect  # noqa: E402
from parc_jax.planner import Planner  # noqa: E402

key, system = jax.random.PRNGKey(3), plant(noisy)
runs = collect.collect(system, key, 150, chunk=16, path=f"{OUT}.runs.npz", quiet=True)
shape = tube([[0, 1]] * 2, np.full((1, 4, 2), 0.1), np.full((1, 3), 0.1))
scores = score_system(
    straight_network(4), system, key, shape, 150, Stage.BOUND, chunk=16, quiet=True
)
rng = np.random.default_rng(2)
model = random_model(rng, bins=(2, 2))
problems = [rectangle_problem(rng, model) for _ in range(21)]
mesh = backend.mesh() if jax.device_count() > 1 else None
answer = Planner(model).solve_batch(problems, key, draws=256, mesh=mesh)
np.savez(
    OUT,
    p=runs.p,
    q=runs.q,
    k=runs.k,
    rows=runs.rows,
    score=scores.score,
    worst=scores.worst,
    found=answer.found,
    plans=answer.plans,
    clearance=answer.clearance,
    draws=answer.draws,
)
