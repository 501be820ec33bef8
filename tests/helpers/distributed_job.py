"""One process of a run over devices and hosts, for test_distributed: rollouts, scores and a batch
of problems.

    python distributed_job.py OUT DEVICES [ADDRESS:PORT,COUNT,NUMBER] [--die-after N]

Writes its results to OUT. With --die-after it kills itself after N chunks of rollouts.
"""

import os
import signal
import sys

import jax

OUT, DEVICES = sys.argv[1], int(sys.argv[2])
HOSTS = next((a for a in sys.argv[3:] if "," in a), None)
DIE_AFTER = int(sys.argv[-1]) if "--die-after" in sys.argv else None
jax.config.update("jax_platforms", "cpu")
jax.config.update("jax_num_cpu_devices", DEVICES)

from parc_jax.common import distributed  # noqa: E402

if HOSTS is not None:
    distributed.init(HOSTS)

import numpy as np  # noqa: E402
from local_rows import local_rows  # noqa: E402
from scored import score_system  # noqa: E402
from synthetic_plants import noisy, plant, straight_network  # noqa: E402
from toy_models import random_model, rectangle_problem  # noqa: E402

from parc_jax.common.errors import ParcError  # noqa: E402
from parc_jax.common.keys import Stage  # noqa: E402
from parc_jax.learning.bound.tube import tube  # noqa: E402
from parc_jax.learning.runs import chunks, collect  # noqa: E402
from parc_jax.planner.planner import Planner  # noqa: E402


def main():
    key, system = jax.random.PRNGKey(3), plant(noisy)
    if DIE_AFTER is not None:
        give_up_after(DIE_AFTER)
    with distributed.shared():
        runs, scores, agreed = shared_work(key, system)
    rng = np.random.default_rng(2)
    model = random_model(rng, bins=(2, 2))
    problems = [rectangle_problem(rng, model) for _ in range(21)]
    mesh = distributed.mesh() if jax.device_count() > 1 else None
    answer = Planner(model).solve_batch(problems, key, draws=256, mesh=mesh)
    k = local_rows(distributed.shard_rows(distributed.mesh(), runs.k[: 8 * (150 // 8)]))
    assert len(k) == 144 // jax.process_count()
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
        agreed=agreed,
    )


def shared_work(key, system):
    runs = collect.collect(system, key, 150, chunk=16, path=f"{OUT}.runs.npz", quiet=True)
    shape = tube([[0, 1]] * 2, np.full((1, 4, 2), 0.1), np.full((1, 3), 0.1))
    scores = score_system(
        straight_network(4), system, key, shape, 150, Stage.BOUND, chunk=16, quiet=True
    )
    agreed = distributed.broadcast({"x": np.full(2, float(jax.process_index()))})["x"]
    return runs, scores, agreed


def give_up_after(n: int):
    put = chunks.ChunkStore.put

    def counted(store, index, arrays):
        put(store, index, arrays)
        counted.left -= 1
        if not counted.left:
            os.kill(os.getpid(), signal.SIGKILL)

    counted.left = n
    chunks.ChunkStore.put = counted


try:
    main()
except ParcError as error:
    print(f"{type(error).__name__}: {error}", file=sys.stderr, flush=True)
    os._exit(1)  # without waiting for those that are gone
