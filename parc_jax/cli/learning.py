"""What `learn` does: the learning of the main job, for one network; from a system or from logged
runs.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from parc_jax.errors import InputError
from parc_jax.experiment.learn import Learned, final_error, learn, learn_recorded
from parc_jax.experiment.numbers import spread
from parc_jax.experiment.settings import Study, name_of
from parc_jax.experiment.stopwatch import Stopwatch
from parc_jax.keys import key_of
from parc_jax.network.predict import outputs
from parc_jax.network.train import training_arrays
from parc_jax.rollout.loaders import load_rollouts
from parc_jax.sets.box import Box, box
from parc_jax.spelling import counted
from parc_jax.system import time_grid


def from_system(system, study: Study, seed: int, work: Path, quiet: bool) -> Learned:
    """Learn a black box. Finished chunks stay in `work`, so a stopped run continues. Raises
    InputError.
    """
    return learn(system, replace(study, others=()), key_of(seed), Stopwatch(), work, quiet)


def refuse_options(options: dict, source: str, of: str) -> None:
    """Raises InputError for the first of these options that was given: they would be ignored."""
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise InputError(
            f"--{given[0]}: expected with {of} only, which {source} is not. Leave it out."
        )


class Log(NamedTuple):
    """Recorded runs: the file, its times (dt, t_f, dt_record) [s] or None, the corners (lo, hi, lo,
    hi, ...) of K or None, how k was drawn, the share of the runs set aside for the bound, names of
    the reference points or None.
    """

    path: Path
    times: tuple[float | None, float | None, float | None]
    domain: tuple[float, ...] | None
    k_law: str
    holdout: float
    points: tuple[str, ...] | None = None


def from_log(log: Log, study: Study, seed: int) -> Learned:
    """Learn recorded runs: a random part for training, the rest for the bound. Raises
    InputError.
    """
    dt, t_f, dt_record = log.times
    if (dt is None) != (t_f is None):
        raise InputError(
            "dt, t-f: expected both, the time between knots and the length of a run in seconds."
        )
    time = None if dt is None else time_grid(dt, t_f, dt_record)
    domain = _domain(log.domain)
    data = load_rollouts(log.path, time, domain, k_law=log.k_law, points=log.points)
    train, held = data.split(log.holdout, seed)
    return learn_recorded(train, held, replace(study, others=()), key_of(seed))


def _domain(corners: tuple[float, ...] | None) -> Box | None:
    if corners is None:
        return None
    if not corners or len(corners) % 2:
        raise InputError(
            f"domain: expected a lower and an upper end per axis of K, lo hi lo hi ...; got "
            f"{len(corners)} numbers."
        )
    return box(corners[::2], corners[1::2])


def summary(learned: Learned, path: Path, as_json: bool = False) -> str:
    """The main model and its claim for a terminal, or as JSON."""
    model, failed = learned.main, int(learned.train.failed.sum())
    k, y = training_arrays(learned.train)
    rms = float(np.sqrt(((outputs(model.net, k) - y) ** 2).mean()))
    facts = {
        "model": str(path),
        "system": model.system,
        "rollouts": learned.train.n,
        "failed": failed,
        "hidden": list(model.net.hidden),
        "training_rms": rms,
        "final_error": final_error(model).tolist(),
        "bins": model.tube.n_bins,
        "start": learned.start.statement(),
        "claim": model.claim.to_json(),
    }
    if as_json:
        return json.dumps(facts, indent=1)
    return "\n".join(
        [
            f"system        {model.system}",
            f"rollouts      {learned.train.n} for training, {failed} of them failed",
            f"network       {name_of(model.net.hidden)}, rms error {rms:.3g} on the training runs",
            f"tube          {counted(model.tube.n_bins, 'bin')}; at the end, median over K: "
            + spread(final_error(model), model, ".3g"),
            f"invariance    {learned.start.statement()}",
            "",
            f"(E) {model.claim.statement()}",
            "",
            f"Written to {path}. Ask with: parc-jax solve {path} SCENE.toml --out answer.json",
        ]
    )
