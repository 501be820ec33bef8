"""From a black box to models: rollouts, networks, claims. For each network the honest claims and the published one."""

import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.distributed import from_all, from_first, shared
from parc_jax.error.search import Attack, enlarge, search_worst
from parc_jax.error.translation import StartTrial, allow_for_start, try_starts
from parc_jax.error.tube import Tube
from parc_jax.keys import Stage, stream
from parc_jax.model import TrajectoryModel, trajectory_model
from parc_jax.network.parc import fit_affine
from parc_jax.network.relu import ReLUNetwork
from parc_jax.network.tail import fit_tail
from parc_jax.network.train import train_report, training_arrays
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.rollout.collect import collect, stream_rollouts
from parc_jax.study.evidence import claims, fresh_runs, scores, shapes
from parc_jax.study.settings import Study, name_of
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
    """Everything learned: the main model first, then the others. start: what is known of the start's influence."""

    models: list[Learned]
    train: RolloutBatch
    start: StartTrial

    @property
    def main(self) -> TrajectoryModel:
        """The model whose answer is returned."""
        return self.models[0].honest


@shared()
def learn(system, study: Study, key: jax.Array, watch: Stopwatch, work: Path, quiet: bool) -> Lesson:
    """Roll out, train every network, claim every tube. Finished chunks stay in `work` until all of it is done.

    The same fresh runs serve all networks and claims: delta is split over them, so all hold together. [T1, looks]
    Raises InputError, also for a system whose start matters more than study.gap.
    """
    with watch("other starts"):
        start = StartTrial(*from_all(try_starts(system, key, study.gap))[0])
    with watch("training rollouts"):
        train = collect(system, key, study.rollouts, Stage.TRAIN, path=work / "train", quiet=quiet)
    further = () if not study.shape_runs else stream_rollouts(
        system, key, study.shape_runs, Stage.TRAIN, first_row=train.n, path=work / "shape", quiet=quiet
    )  # fmt: skip

    def fresh(n: int) -> Iterable[RolloutBatch]:
        return stream_rollouts(system, key, n, Stage.BOUND, path=work / "fresh", quiet=quiet)

    def attack(net: ReLUNetwork, shape: Tube) -> Attack:
        return Attack(*from_first(tuple(search_worst(net, system, key, shape, study.search))))

    lesson = _taught(train, further, fresh, attack if study.search else None, start, study, key, watch)
    shutil.rmtree(work, ignore_errors=True)
    return lesson


def learn_recorded(train: RolloutBatch, held: RolloutBatch, study: Study, key: jax.Array) -> Lesson:
    """The same from recorded runs: `held` sizes the tubes, and nothing can be run again or searched."""
    return _taught(train, (), lambda n: (held,), None, StartTrial(study.gap, None), study, key, Stopwatch())


def _taught(train, further, fresh, attack, start: StartTrial, study: Study, key, watch: Stopwatch) -> Lesson:
    """Networks from the training runs, shapes from these and `further` ones, claims from `fresh(n)`.

    attack: (net, shape) -> runs that were searched for, or None.
    """
    looks = len(study.networks) * len(study.claims)
    with watch("training"):
        # hosts may round training differently, and a claim is about one network
        nets = from_first(networks(train, study, key))
    with watch("shape"):
        tubes = shapes(nets, train, further, study, key)
    with watch("fresh rollouts"):
        seen = scores(nets, tubes, fresh(fresh_runs(study, tubes[0], looks)))
    models = []
    for hidden, net, shape, score in zip(study.networks, nets, tubes, seen, strict=True):
        with watch("claims"):
            published, honest = claims(net, shape, score, train, study, looks)
        if attack is not None and not models:  # the network whose answer is returned
            with watch("search for bad runs"):
                found = attack(net, shape)
                honest = [enlarge(claim, shape, found) for claim in honest]
        assumed, *claimed = (
            trajectory_model(net, claim, train.domain, train.time, train.name)
            for claim in (published, *(allow_for_start(claim, start) for claim in honest))
        )
        models.append(Learned(name_of(hidden), assumed, claimed))
    return Lesson(models, train, start)


def networks(train: RolloutBatch, study: Study, key: jax.Array) -> list[ReLUNetwork]:
    """The trained networks in the order of study.networks; PARC as published: an affine least-squares fit."""
    nets = []
    for number, hidden in enumerate(study.networks):
        if not hidden:
            nets.append(fit_affine(*training_arrays(train)))
            continue
        fit = jax.random.fold_in(stream(key, Stage.FIT), number)
        net = train_report(train, hidden, key=fit, seeds=study.seeds, steps=study.steps)[0]
        nets.append(net if study.tail is None else fit_tail(net, train, study.tail))
    return nets


def final_error(model: TrajectoryModel) -> np.ndarray:
    """(n_p + n_q,) median over the bins with a claim of the half widths at the end; infinite when there is none."""
    final = model.tube.final[model.tube.claimed]
    return np.median(final, axis=0) if len(final) else np.full(model.n_p + model.n_q, np.inf)
