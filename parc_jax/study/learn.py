"""From a black box to models: rollouts, networks, claims. For each network the honest claims and the published one."""

import shutil
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.distributed import from_first, shared
from parc_jax.keys import Stage, stream
from parc_jax.model import TrajectoryModel, trajectory_model
from parc_jax.network.parc import fit_affine
from parc_jax.network.relu import ReLUNetwork
from parc_jax.network.tail import fit_tail
from parc_jax.network.train import train_report, training_arrays
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.rollout.collect import collect
from parc_jax.study.evidence import claims, fresh_runs, scores, shapes
from parc_jax.study.settings import Study
from parc_jax.study.stopwatch import Stopwatch


class Learned(NamedTuple):
    """One network with its claims. name: "PARC" or its widths. claimed: by study.claims."""

    name: str
    assumed: TrajectoryModel
    claimed: list[TrajectoryModel]

    @property
    def honest(self) -> TrajectoryModel:
        """The model of the first claim."""
        return self.claimed[0]


class Lesson(NamedTuple):
    """Everything learned: the main model first, then the others, PARC last."""

    models: list[Learned]
    train: RolloutBatch

    @property
    def main(self) -> TrajectoryModel:
        """The model whose answer is returned."""
        return self.models[0].honest


@shared()
def learn(system, study: Study, key: jax.Array, watch: Stopwatch, work: Path, quiet: bool) -> Lesson:
    """Roll out, train every network, claim every tube. Finished chunks stay in `work` until all of it is done.

    The same fresh runs serve all networks and claims: delta is split over them, so all hold together. [T1, looks]
    """
    looks = (len(study.networks) + 1) * len(study.claims)
    with watch("training rollouts"):
        train = collect(system, key, study.rollouts, Stage.TRAIN, path=work / "train", quiet=quiet)
    with watch("training"):
        # hosts may round training differently, and a claim is about one network
        nets = from_first(networks(train, study, key))
    with watch("shape"):
        tubes = shapes(nets, system, train, study, key, work / "shape", quiet)
    with watch("fresh rollouts"):
        n = fresh_runs(study, tubes[0], looks)
        seen = scores(nets, tubes, system, key, n, work / "fresh", quiet)
    names = ["-".join(str(w) for w in hidden) for hidden in study.networks] + ["PARC"]
    models = []
    with watch("claims"):
        for name, net, shape, score in zip(names, nets, tubes, seen, strict=True):
            published, honest = claims(net, shape, score, train, study, looks)
            assumed, *claimed = (
                trajectory_model(net, claim, system.domain, system.time, system.name) for claim in (published, *honest)
            )
            models.append(Learned(name, assumed, claimed))
    shutil.rmtree(work, ignore_errors=True)
    return Lesson(models, train)


def networks(train: RolloutBatch, study: Study, key: jax.Array) -> list[ReLUNetwork]:
    """The trained networks in the order of study.networks, then PARC as published: an affine least-squares fit."""
    nets = []
    for number, hidden in enumerate(study.networks):
        fit = jax.random.fold_in(stream(key, Stage.FIT), number)
        net = train_report(train, hidden, key=fit, seeds=study.seeds, steps=study.steps)[0]
        nets.append(net if study.tail is None else fit_tail(net, train, study.tail))
    return [*nets, fit_affine(*training_arrays(train))]


def final_error(model: TrajectoryModel) -> np.ndarray:
    """(n_p + n_q,) median over the bins with a claim of the half widths at the end; infinite when there is none."""
    final = model.tube.final[model.tube.claimed]
    return np.median(final, axis=0) if len(final) else np.full(model.n_p + model.n_q, np.inf)
