"""The study beside others: halves swapped, and networks without the twist model.

python -m sims.foreign.husky.compare
"""

import jax

from parc_jax.common.spelling import rounded_down
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.network.train import train
from parc_jax.planner import Planner
from parc_jax.safe_set.settings import Settings
from sims.foreign.husky.job import EPS
from sims.foreign.husky.learn import Halves, claimed, halves, network
from sims.foreign.husky.log import read_log
from sims.foreign.husky.scenario import problem

SEEDS, STEPS = 4, 3000  # of networks trained on the recorded runs themselves


def main() -> None:
    """A row per network: widest corner of the tube at the end, and the answer."""
    log, key = read_log(), jax.random.PRNGKey(0)
    runs = halves(log)
    other = log._replace(number=log.number + 1)  # odd commands train
    print(
        "network                       tube at the end     status, share of K (99.9 %)", flush=True
    )
    told("twist model, as the study", network(log, key), runs, key)
    told("twist model, halves swapped", network(other, key), halves(other), key)
    for hidden in ((8, 8), (24, 24)):
        net = train(runs.train, hidden, key=key, seeds=SEEDS, steps=STEPS)
        told(f"100 recorded runs, {hidden}", net, runs, key)


def told(name: str, net: ReLUNetwork, runs: Halves, key: jax.Array) -> None:
    """Claim, solve and print a row."""
    model = claimed(net, runs, EPS)
    driving, turning = 100 * model.tube.interval[[0, 2], -1].max(axis=1)
    answer = Planner(model).solve(problem(), key, Settings(samples=10))
    share = f", at least {rounded_down(100 * answer.share_of_k())} %" if answer.status.found else ""
    print(
        f"{name:28}  {driving:.0f} cm, {turning:.0f} cm  {answer.status.label}{share}", flush=True
    )


if __name__ == "__main__":
    main()
