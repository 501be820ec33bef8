"""Few real runs: a network learned from a prior, and a claim from the recorded runs alone."""

import numpy as np

from parc_jax.common.keys import key_of
from parc_jax.common.spelling import counted
from parc_jax.learning.bound.counts import MOST, advised_discards, required_runs, width_needed
from parc_jax.learning.bound.pipeline import RecordedRuns, bound_errors, learn_profiles
from parc_jax.learning.bound.start_gap import StartTrial
from parc_jax.learning.learn import Learned, models, networks
from parc_jax.learning.prior.teach import TWIST, Taught, taught
from parc_jax.learning.runs.batch import RolloutBatch, worst_by_group
from parc_jax.learning.settings import Learning

HOLDOUT = 0.5  # of the recorded runs: a prior has little to learn from the others
# what is asked where nothing else is: runs of a prior are without noise, and as many as one likes
ASKED = {"rollouts": 8000, "hidden": (24, 24), "seeds": 2}


def learn_from(
    runs: RolloutBatch, prior=TWIST, *, holdout: float = HOLDOUT, seed: int = 0, **options
) -> Learned:
    """Learn few recorded runs of a robot from a prior: `.main` is the model, `.prior` says what
    became of the prior.

    prior: "twist", for a robot on the ground: its body moves ahead, sideways and turns as k says,
        by least squares of the training runs; or any system, such as a simulator, with the time
        grid, points and goal states of the runs and a domain that holds theirs. It gives the
        network its shape. No claim is about it: the held-out runs of the robot size the tube,
        however bad it is.
    holdout: share of the runs, or of their groups, that size the tube; drawn by `seed`, as all
        else. The others identify and correct the prior and give the tube its profile.
    options: fields of `Learning` by name, such as eps=0.1 or hidden=(16, 16); by default ASKED.
        Where the held-out runs are too few for eps, discard="most" is as many as the training runs
        advise, fixed before a held-out one is seen [T2].
    Raises InputError.
    """
    asked = Learning(**(ASKED | options))
    key = key_of(seed)
    train, held = runs.split(holdout, seed)
    own = taught(prior, train, asked.rollouts, key)
    nets = networks(own.runs, asked, key)
    usual, advised = _usual(own, train, held, asked)
    bins = (1,) * runs.n_k if asked.bins is None else asked.bins
    profiles = learn_profiles(nets, usual, (), bins, shape=asked.shape)
    start = StartTrial(asked.gap, None)
    given, said = asked.discard, own.said
    asked = asked.replace(discard=advised)
    claims = bound_errors(nets, RecordedRuns(held), train, asked, start, profiles=profiles)
    if advised != given:
        unit = "run" if held.groups is None else "recording"
        left = counted(advised, f"held-out {unit}")
        said = f"{said}; {left} left outside, a number chosen before one was seen"
    return Learned(models(nets, claims, train, asked), train, start, said)


def _usual(
    own: Taught, train: RolloutBatch, held: RolloutBatch, asked: Learning
) -> tuple[RolloutBatch, int | str]:
    """The training runs that give the profile, and how many held-out ones to leave outside: what is
    discarded there should not widen it here.
    """
    looks = asked.looks * len(asked.networks) * len(asked.claims)
    n = held.n if held.groups is None else len(np.unique(held.groups))
    delta = float(asked.delta) / looks
    if (
        asked.discard != MOST
        or "bins" in asked.claims
        or n >= required_runs(float(asked.eps), delta)
    ):
        return own.unseen, asked.discard
    sizes = worst_by_group(own.size, train.groups)
    discard = advised_discards(sizes, n, delta)
    near = own.size[np.isfinite(own.size)] <= width_needed(sizes, n, discard)
    return own.unseen.select(near), discard
