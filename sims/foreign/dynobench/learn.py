"""The models of dynobench's robots: learned once, kept as files."""

from pathlib import Path

import jax

import parc_jax as pj
from sims.foreign.dynobench.system import system

EPS, DELTA, FRESH = 1e-2, 1e-3, 4_000
# runs, hidden layers, steps; the unicycle with speeds as states has five parameters and 6.4 s
EFFORT = {
    "unicycle1_v0": (10_000, (64, 64), 8_000),
    "unicycle2_v0": (20_000, (96, 96), 12_000),
    "car1_v0": (10_000, (64, 64), 8_000),
}


def learned(robot: str, folder: Path) -> pj.types.TrajectoryModel:
    """The model of a robot, from its file in the folder, or learned and kept there."""
    path = folder / f"{robot}.npz"
    if path.exists():
        return pj.load(path)
    folder.mkdir(parents=True, exist_ok=True)
    black_box, key = system(robot), jax.random.PRNGKey(0)
    n, hidden, steps = EFFORT[robot]
    runs = pj.learning.collect(black_box, key, n=n)
    net = pj.learning.train(runs, hidden=hidden, key=key, seeds=2, steps=steps)
    claim = pj.learning.bound_error(
        net,
        black_box,
        key,
        eps=EPS,
        delta=DELTA,
        fresh=FRESH,
        discard="most",
        bins=(1,) * net.n_in,
        shape="fitted",
        train=runs,
    )
    black_box.close()
    model = pj.learning.trajectory_model(net, claim)
    model.save(path)
    return model
