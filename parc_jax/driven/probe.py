"""Probes: a few runs on each of some small boxes of K, an affine map, and how nearly it is safe."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from parc_jax.claim.declared import assumed_claim
from parc_jax.claim.profile import training_profile
from parc_jax.driven.nearly import Nearly, nearly_safe, shrunk
from parc_jax.driven.safe_box import box_around
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.model import TrajectoryModel, trajectory_model
from parc_jax.network.parc import fit_affine
from parc_jax.network.train import training_arrays
from parc_jax.problem import ReachAvoid
from parc_jax.rollout.batch import RolloutBatch, concatenate
from parc_jax.rollout.collect import stream_rollouts
from parc_jax.sets.box import Box
from parc_jax.verdict.scene import scene_of

# [1] by what factor the errors of a few runs are widened, to stand for those of many
MANY = 1.25


class Probe(NamedTuple):
    """A box of K and what a few runs on it promise. plans: of the guessed model, best first. end:
    (n_c + n_q,) its half widths at the end.
    """

    box: Box
    plans: Nearly
    end: np.ndarray

    @property
    def score(self) -> tuple[float, float]:
        """Larger is better."""
        return self.plans.score


def probes(
    system, problem: ReachAvoid, like: TrajectoryModel, centres, share: float, runs: int, key, rng
) -> list[Probe]:
    """A probe around every centre (m, n_k), on boxes that take `share` of K, the best first; boxes
    on which too few runs are finite are left out.
    """
    whole = like.domain
    boxes = [box_around(k, share ** (1 / whole.n), whole) for k in centres]
    k = np.concatenate([rng.uniform(box.lo, box.hi, (runs, whole.n)) for box in boxes])
    seen = concatenate(stream_rollouts(system, key, len(k), Stage.SEARCH, k=k, quiet=True))
    found = []
    for number, box in enumerate(boxes):
        own = seen.select(slice(number * runs, (number + 1) * runs))
        model = guessed(replace(own, domain=box), like)
        if model is not None:
            plans = nearly_safe(model, scene_of(problem, model), rng)
            found.append(Probe(box, plans, model.tube.final[0]))
    return sorted(found, key=lambda probe: probe.score, reverse=True)


def guessed(runs: RolloutBatch, like: TrajectoryModel) -> TrajectoryModel | None:
    """An affine model of a few runs with a tube that they suggest; nothing is claimed of it. None
    when too few of them are finite.
    """
    finite = runs.select(~runs.failed)
    try:
        net = fit_affine(*training_arrays(finite))
        profile = training_profile(net, finite, (1,) * finite.n_k)
    except InputError:
        return None
    claim = assumed_claim(net, finite)
    claim = replace(claim, tube=shrunk(profile, MANY), evidence={})
    return trajectory_model(
        net, claim, runs.domain, like.time, like.system, like.labels, like.points
    )


def spread_out(plans: Nearly, domain: Box, most: int, apart: float) -> np.ndarray:
    """(m, n_k) the k of good plans, each at least `apart` [sides of the domain] from the better
    ones.
    """
    side = domain.hi - domain.lo
    chosen: list[np.ndarray] = []
    for k in plans.k:
        if all(np.abs((k - other) / side).max() >= apart for other in chosen):
            chosen.append(k)
        if len(chosen) == most:
            break
    return np.array(chosen).reshape(-1, domain.n)
