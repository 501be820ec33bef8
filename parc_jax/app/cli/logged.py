"""Logged runs for `learn`: their options, how they are read, and the printed summary."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from parc_jax.app.cli.systems import black_box_with, find
from parc_jax.app.study.report import final_error, spread
from parc_jax.common.errors import InputError
from parc_jax.common.keys import key_of
from parc_jax.common.options import Options
from parc_jax.common.sets.box import box
from parc_jax.common.spelling import counted
from parc_jax.learning.learn import WITH_PRIOR, Learned, Learning, learn_report
from parc_jax.learning.network.predict import outputs
from parc_jax.learning.network.train import training_arrays
from parc_jax.learning.prior.identify import moving_body
from parc_jax.learning.prior.teach import TWIST
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.loaders import load_rollouts
from parc_jax.learning.system import time_grid

NONE, FEW = "none", 1000  # no prior; recordings from which on a network needs none
# options of a study that ask for runs of a system
NEW_RUNS = ("plant", "body", "rollouts", "profile_runs", "fresh")


@dataclass(frozen=True)
class Logged(Options):
    """How logged runs are read."""

    dt: float | None = None
    """Logged runs only: time between model knots [s]. Default: the file's own, if it has one."""
    t_f: float | None = None
    """Logged runs only: length of a run [s]. Default: the file's own, if it has one."""
    dt_record: float | None = None
    """Logged runs only: time between records [s]. Default: dt."""
    points: tuple[str, ...] | None = None
    """Logged runs only: names of the robot's reference points, in the order of the columns.
    Default: the file's own, or one point."""
    holdout: float | None = None
    """Logged runs only: share of the runs set aside for the bound. Default: 0.4, or 0.5 with a
    prior."""
    prior: str | None = None
    """Logged runs only, where they are few: what gives the network its shape, "twist" for a robot
    on the ground, or a system, such as a simulator of it, or "none". The claim is from the logged
    runs alone. Default: twist below 1,000 recordings of a rigid body of several points. With one
    other defaults hold: 8,000 rollouts of it, 2 networks of 24 24, one bin."""
    domain: tuple[float, ...] | None = None
    """Logged runs only: K as LO HI for every parameter. Default: the box of the
    training runs' k; the claim says how many others it misses."""
    given: tuple[str, ...] = ()
    """Logged runs only: names of parameters that are measured at the start, not chosen."""
    k_law: str = "logged"
    """Logged runs only: "uniform" if all k were drawn uniformly from the domain; only then does the
    claim speak of shares of K, and k that refute it are refused."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.dt is None) != (self.t_f is None):
            raise InputError(
                "dt, t-f: expected both, the time between knots and the length of a run in seconds."
            )


def refuse(given: Iterable[str], source: str, of: str) -> None:
    """Raises InputError for the first of these options that were given: it would be ignored."""
    for name in given:
        option = f"--{name.replace('_', '-')}"
        raise InputError(f"{option}: expected with {of} only, which {source} is not. Leave it out.")


def from_log(path: Path, log: Logged, study: dict, seed: int) -> Learned:
    """Learn recorded runs: a random part for training, the rest for the bound. study: fields of
    `Learning`. Raises InputError.
    """
    time = None if log.dt is None else time_grid(log.dt, log.t_f, log.dt_record)
    corners = log.domain
    if corners is not None and (not corners or len(corners) % 2):
        raise InputError(
            f"domain: expected a lower and an upper end per axis of K, lo hi lo hi ...; got "
            f"{len(corners)} numbers."
        )
    domain = None if corners is None else box(corners[::2], corners[1::2])
    data = load_rollouts(path, time, domain, k_law=log.k_law, points=log.points, given=log.given)
    prior = _usual_prior(data) if log.prior is None else log.prior
    if prior == NONE:
        prior = None
    elif prior is not None and prior != TWIST:
        prior = black_box_with(find(prior, needed=("system",)), data.points)
    settings = (Learning() if prior is None else WITH_PRIOR).replace(**study)
    return learn_report(data, key_of(seed), settings, prior, holdout=log.holdout)


def _usual_prior(runs: RolloutBatch) -> str | None:
    """A twist for few recordings of a rigid body, which is left out where these say so."""
    if len(runs.points) == 1 or runs.recordings >= FEW:
        return None
    try:
        moving_body(runs)
    except InputError:
        return None
    return TWIST


def summary(learned: Learned, path: Path, as_json: bool = False) -> str:
    """The main model and its claim for a terminal, or as JSON."""
    model, failed = learned.model, int(learned.train.failed.sum())
    k, y = training_arrays(learned.train)
    rms = float(np.sqrt(((outputs(model.net, k) - y) ** 2).mean()))
    facts = {
        "model": str(path),
        "system": model.system,
        "rollouts": learned.train.n,
        "failed": failed,
        "hidden": list(model.net.hidden),
        "training_rms": rms,
        "final_error": [x if np.isfinite(x) else None for x in final_error(model).tolist()],
        "bins": model.tube.n_bins,
        "prior": learned.prior,
        "claim": model.claim.to_json(),
    }
    if as_json:
        return json.dumps(facts, indent=1)
    at_end = spread(final_error(model), model, ".3g")
    widths = "-".join(map(str, model.net.hidden))  # none of one affine map
    lines = [
        f"system        {model.system}",
        f"rollouts      {learned.train.n} for training, {failed} of them failed",
        f"network       {widths or 'PARC'}, rms error {rms:.3g} on the training runs",
        f"tube          {counted(model.tube.n_bins, 'bin')}; at the end, median over K: {at_end}",
        *([] if learned.prior is None else [f"prior         {learned.prior}"]),
        f"\n(E) {model.claim.details()}\n",
        f"Written to {path}. Ask with: parc-jax solve {path} SCENE.toml --out answer.json",
    ]
    return "\n".join(lines)
