"""Safe sets that get ever smaller: straight lines through a slit between two blocks. How long until
99 % of the safe plans are certified by corridors, in seconds of the processor, over the share of
all plans that is safe.

The model is exact and the tube has no width, so the share is known from the slit: it falls with the
square of its width. A small query of the same kind has compiled everything before.
"""

import time

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import exact, metric
from benchmarks.result import Result, Table
from parc_jax.common.sets.box import box
from parc_jax.learning.bound.declared import declared_claim
from parc_jax.learning.bound.tube import zero_tube
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.relu import relu_network
from parc_jax.learning.system import time_grid
from parc_jax.planner.planner import Planner
from parc_jax.problem.problem import ReachAvoid, reach_avoid
from parc_jax.safe_set.settings import Settings

T = 8
HALVES = (0.03, 3e-3, 3e-4, 3e-5, 3e-6, 3e-7)  # [m] of the slit
SEEDS = 3


def run(bench: Bench) -> Result:
    """One slit after another, several seeds each."""
    planner = Planner(lines())
    settings = Settings(samples=20, target=0.01, work=bench.size(1.0, 0.2), proof=False)
    for half in HALVES[:3]:
        planner.solve(slit(half), bench.key(99), settings)
    metrics, rows = [], []
    for half in bench.size(HALVES, HALVES[:3]):
        spent, shares, found = [], [], 0
        for seed in range(bench.size(SEEDS, 1)):
            begin = time.process_time()
            answer = planner.solve(slit(half), bench.key(seed), settings)
            spent.append(time.process_time() - begin)
            if answer.status.found:
                found += 1
                shares.append(answer.share.volume[0] / whole())
        name = f"rare.half_{half:g}"
        seeds = len(spent)
        metrics += [
            metric(f"{name}.cpu", np.median(spent), "s", "lower", rel_tol=1.0),
            exact(f"{name}.none_found", seeds - found),
        ]
        share = f"{np.median(shares):.1e}" if shares else "none found"
        spread = f"{np.median(spent):.2f} s ({min(spent):.2f} to {max(spent):.2f})"
        rows.append((f"{half:g} m", share, f"{found} of {seeds}", spread))
    header = ("half the slit", "safe share", "found", "99 % certified, CPU")
    return Result(metrics, [Table("Rare safe sets", header, rows)])


def lines() -> TrajectoryModel:
    """Straight lines, c_t = (t / T) k, over K = [-2, 2]^2; one further state that is always 0."""
    W = np.concatenate([np.kron(np.arange(1, T + 1)[:, None] / T, np.eye(2)), np.zeros((1, 2))])
    net = relu_network([W], [np.zeros(2 * T + 1)])
    none = zero_tube(([-2.0, 2.0], [-2.0, 2.0]), T, 2, 3)
    time = time_grid(1.0 / T, 1.0)
    claim = declared_claim(none, "the model is exact", net, time, system="lines")
    return trajectory_model(net, claim)


def slit(half: float) -> ReachAvoid:
    """From the left of two blocks to their right, through a slit of width 2 half."""
    goal = box([0.6, -1.0, -1.0], [1.0, 1.0, 1.0])
    start = box([-1.6, -0.5], [-1.1, 0.5])
    blocks = [box([-0.5, 0.1 + half], [0.5, 3.0]), box([-0.5, -3.0], [0.5, 0.1 - half])]
    return reach_avoid(goal, blocks, 0.0, start=start)


def whole() -> float:
    """Volume of all that could reach the goal: its box times K."""
    return 0.4 * 2.0 * 16.0
