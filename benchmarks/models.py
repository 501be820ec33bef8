"""Networks and their tubes, learned inside the run: nothing is measured on data that somebody else
prepared.
"""

from typing import NamedTuple

import jax

from benchmarks.cases import Case
from parc_jax.common.keys import Stage, stream
from parc_jax.learning.bound.calibrate import calibrate
from parc_jax.learning.bound.counts import required_runs
from parc_jax.learning.bound.declared import assumed_claim
from parc_jax.learning.bound.pipeline import learn_profile
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.fit import fit_affine
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.network.train import train, training_arrays
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.collect import collect

PARC = ()  # hidden widths of PARC's model: none
CHUNK = 256


class Claims(NamedTuple):
    """One network under two tubes. assumed: the published kind, largest training error, one bin.
    honest: at eps.
    """

    assumed: TrajectoryModel
    honest: TrajectoryModel


class CaseModels(NamedTuple):
    """case, system and its training rollouts; models by hidden widths; eps of the honest claims,
    all valid at once.
    """

    case: Case
    system: object
    train: RolloutBatch
    models: dict[tuple[int, ...], Claims]
    eps: float


def learn(case: Case, key: jax.Array, quick: bool) -> CaseModels:
    """Roll out, train every network of the case, claim both tubes of each. One holdout serves all:
    delta is split.
    """
    hidden = case.hidden[-1:] if quick else (*case.hidden, case.larger)
    eps, delta, bins = (0.05, 0.05, (2,) * len(case.bins)) if quick else (1e-3, 1e-3, case.bins)
    runs, seeds, steps = (256, 1, 50) if quick else (10_240, 4, 4000)
    looks = len(hidden) + 1
    system = case.system()
    data = collect(system, key, runs, Stage.TRAIN, chunk=CHUNK, quiet=True)
    fresh = required_runs(eps, delta / looks, 0)
    holdout = collect(system, key, fresh, Stage.BOUND, chunk=CHUNK, quiet=True)
    nets: dict[tuple[int, ...], ReLUNetwork] = {
        widths: train(
            data,
            widths,
            key=jax.random.fold_in(stream(key, Stage.FIT), number),
            seeds=seeds,
            steps=steps,
        )
        for number, widths in enumerate(hidden)
    }
    nets[PARC] = fit_affine(*training_arrays(data))
    models = {}
    for widths, net in nets.items():
        honest = calibrate(
            net,
            holdout,
            learn_profile(net, data, (), bins),
            eps=eps,
            delta=delta,
            looks=looks,
            train=data,
        )
        models[widths] = Claims(
            *(trajectory_model(net, claim) for claim in (assumed_claim(net, data), honest))
        )
    return CaseModels(case, system, data, models, eps)


def name_of(widths: tuple[int, ...]) -> str:
    """4x8 for (8, 8, 8, 8)."""
    if not widths:
        return "affine"
    return f"{len(widths)}x{widths[0]}" if len(set(widths)) == 1 else "-".join(map(str, widths))
