"""From the log to a model with a claim: shape from training commands, size from the others.

Commands of even number train: they give the twist model, from whose runs the network is
trained, and the profile of the tube. Commands of odd number, each with the wheel speeds that the
robot had before it, are disjoint from each other and size the tube. The halves are fixed by the
order of time, and nothing is drawn.
"""

from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.keys import Stage
from parc_jax.learning.bound.calibrate import calibrate
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.bound.measure import measure
from parc_jax.learning.bound.pipeline import bound_error
from parc_jax.learning.bound.tube import Tube, tube
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.network.train import train
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.collect import collect
from sims.foreign.husky import params as c
from sims.foreign.husky.log import Log, domain, grid, recorded, windows
from sims.foreign.husky.twist import TwistModel, identify

HIDDEN = (24, 24)
MODEL_RUNS = 8000  # of the twist model
SEEDS, STEPS = 2, 3000  # of the training
DELTA = 0.05
CM = 0.01  # [m]
LOOK_EPS = 0.05  # of the first look, which nobody relies on: the network has seen these runs


class Halves(NamedTuple):
    """Recorded runs of even and of odd commands."""

    train: RolloutBatch
    held: RolloutBatch


def halves(log: Log) -> Halves:
    """The runs for shape and profile, and those for the size of the tube."""
    runs, even = recorded(log), log.number % 2 == 0
    return Halves(runs.select(even), runs.select(~even))


def network(log: Log, key: jax.Array) -> ReLUNetwork:
    """The network of the twist model that the even commands of the log identify."""
    even = log.select(log.number % 2 == 0)
    p, yaw = windows(even)
    t = np.arange(p.shape[1]) * grid().dt_record
    twist = identify(t, p, yaw, even.command)
    return trained(TwistModel(twist, domain(), grid(), (c.LENGTH, c.WIDTH)), key)


def trained(model: TwistModel, key: jax.Array) -> ReLUNetwork:
    """The network of a twist model, from runs of it."""
    runs = collect(model, key, MODEL_RUNS, Stage.TRAIN, quiet=True)
    return train(runs, HIDDEN, key=key, seeds=SEEDS, steps=STEPS)


def edges() -> tuple[np.ndarray, np.ndarray]:
    """Bins over K: backward, sticking and forward, of either side."""
    lo, hi = c.COMMANDS
    each = np.array([lo, -c.STICKING, c.STICKING, hi])
    return each, each


def profile(net: ReLUNetwork, runs: RolloutBatch) -> Tube:
    """The largest errors of the training runs, of all commands that drive together and of all that
    turn, and many times the larger of them where a wheel may stick.
    """
    errors = measure(net, runs)
    sticking = (np.abs(runs.k) < c.STICKING).any(axis=1)
    turning = runs.k[:, 0] * runs.k[:, 1] < 0
    kinds = (~sticking & ~turning, ~sticking & turning)
    drive, turn = ([part[kind].max(axis=0) for part in errors] for kind in kinds)
    strip = [c.STRIPS_WIDER * np.maximum(*both) for both in zip(drive, turn, strict=True)]
    side = (drive, strip, turn)
    bins = [side, (strip, strip, strip), side[::-1]]  # of the left wheels, each over the right
    flat = [kind for row in bins for kind in row]
    interval, final = (np.stack(part) for part in zip(*flat, strict=True))
    return tube(edges(), interval + c.POSE_NOISE, final + c.POSE_NOISE, len(runs.points))


def claimed(net: ReLUNetwork, runs: Halves, eps: float, discard: int | str = 0) -> TrajectoryModel:
    """The network with the claim that the held-out runs support. Raises InputError."""
    claim = bound_error(
        net,
        runs.held,
        None,
        eps=eps,
        delta=DELTA,
        profile=profile(net, runs.train),
        train=runs.train,
        discard=discard,
    )
    return trajectory_model(net, claim)


def first_look(net: ReLUNetwork, runs: RolloutBatch) -> list[dict]:
    """The worst training commands, worst first: command, k [rad/s], score = largest error of a
    corner [cm]. They are what a claim about these runs names as its evidence, with a tube that is
    as wide everywhere; so the sticking wheels were found, before a held-out run was looked at.
    """
    lo, hi = c.COMMANDS
    shape = (1, runs.time.n_steps, runs.n_c)
    even = tube(([lo, hi], [lo, hi]), np.full(shape, CM), np.full(shape[::2], CM), len(runs.points))
    return worst(calibrate(net, runs, even, eps=LOOK_EPS, delta=DELTA))


def worst(claim: ErrorClaim, most: int = 10) -> list[dict]:
    """The worst commands behind a claim: command, k [rad/s], score."""
    return [
        {
            "command": one["row"],
            "k": [float.fromhex(x) for x in one["k"]],
            "score": float.fromhex(one["score"]),
        }
        for one in claim.evidence["worst"][:most]
    ]
