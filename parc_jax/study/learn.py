"""From a black box to models: rollouts, networks, claims. Two claims for each network, the honest and the published."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.error.bound import assumed_claim
from parc_jax.error.calibrate import calibrate
from parc_jax.error.counts import required_runs
from parc_jax.error.shape import training_shape
from parc_jax.error.tube import refined
from parc_jax.keys import Stage
from parc_jax.model import TrajectoryModel, trajectory_model
from parc_jax.network.parc import fit_affine
from parc_jax.network.train import train_report, training_arrays
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.rollout.collect import collect
from parc_jax.study.settings import Study
from parc_jax.study.stopwatch import Stopwatch


class Learned(NamedTuple):
    """One network with both claims. name: "PARC" or its widths."""

    name: str
    honest: TrajectoryModel
    assumed: TrajectoryModel


class Lesson(NamedTuple):
    """Everything learned: the main model first, then the others, PARC last."""

    models: list[Learned]
    train: RolloutBatch
    holdout: RolloutBatch

    @property
    def main(self) -> TrajectoryModel:
        """The model whose answer is returned."""
        return self.models[0].honest


def learn(system, study: Study, key: jax.Array, watch: Stopwatch, work: Path, quiet: bool) -> Lesson:
    """Roll out, train every network, claim every tube. Finished chunks stay in `work` until all of it is done.

    One holdout serves all networks: delta is split over them, so all honest claims hold together. [T1, looks]
    """
    looks = len(study.networks) + 1
    n_fresh = required_runs(study.eps, study.delta / looks, 0)
    with watch("training rollouts"):
        train = collect(system, key, study.rollouts, Stage.TRAIN, path=work / "train", quiet=quiet)
    models = []
    with watch("training"):
        nets = []
        for number, hidden in enumerate(study.networks):
            fit = jax.random.fold_in(key, number)
            nets.append(train_report(train, hidden, key=fit, seeds=study.seeds, steps=study.steps)[0])
        nets.append(fit_affine(*training_arrays(train)))
    with watch("fresh rollouts"):
        holdout = collect(system, key, n_fresh, Stage.BOUND, path=work / "holdout", quiet=quiet)
    names = ["-".join(str(w) for w in hidden) for hidden in study.networks] + ["PARC"]
    bins = study.bins
    with watch("claims"):
        for name, net in zip(names, nets, strict=True):
            shape = training_shape(net, train, bins)
            bins = bins or shape.edges  # all networks share the main one's bins, and so its compiled code
            honest = calibrate(net, holdout, shape, study.eps, study.delta, looks=looks, train=train)
            published = assumed_claim(net, train)
            # one bin, told on the bins of the honest tube: equal shapes share compiled code
            published = replace(published, tube=refined(published.tube, honest.tube.edges))
            both = (
                trajectory_model(net, claim, system.domain, system.time, system.name) for claim in (honest, published)
            )
            models.append(Learned(name, *both))
    shutil.rmtree(work, ignore_errors=True)
    return Lesson(models, train, holdout)


def final_error(model: TrajectoryModel) -> np.ndarray:
    """(n_p + n_q,) median over the bins of the half widths at the end."""
    return np.median(model.tube.final, axis=0)
