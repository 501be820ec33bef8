"""What `learn` does: test invariance, roll out, train, bound; from a system or from logged runs."""

import json
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.error.bound import bound_error
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.model import TrajectoryModel, trajectory_model
from parc_jax.network.train import TrainReport, train_report
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.rollout.collect import collect
from parc_jax.rollout.invariance import can_start_elsewhere, translation_gap
from parc_jax.rollout.loaders import load_rollouts
from parc_jax.study.learn import final_error
from parc_jax.study.settings import Study
from parc_jax.system import time_grid

STARTS = 8  # other starts tried, up to this many times the travelled distance away
FAR = 10.0


class Learned(NamedTuple):
    """A model and how it came about. invariance: one sentence."""

    model: TrajectoryModel
    train: RolloutBatch
    fit: TrainReport
    invariance: str

    def report(self, path: Path, as_json: bool = False) -> str:
        """For a terminal, or as JSON."""
        model, failed = self.model, int(self.train.failed.sum())
        facts = {
            "model": str(path), "system": model.system, "rollouts": self.train.n, "failed": failed,
            "hidden": list(model.net.hidden), "held_out_rms": float(self.fit.rms[self.fit.best]),
            "final_error": final_error(model).tolist(), "bins": model.tube.n_bins, "invariance": self.invariance,
            "claim": model.claim.to_json(),
        }  # fmt: skip
        if as_json:
            return json.dumps(facts, indent=1)
        return "\n".join([
            f"system        {model.system}",
            f"rollouts      {self.train.n} for training, {failed} of them failed",
            f"network       {'-'.join(map(str, model.net.hidden))}, held-out rms error {facts['held_out_rms']:.3g} m",
            f"tube          {model.tube.n_bins} bins; at the end, median over K: "
            + ", ".join(f"±{v:.3g}" for v in facts["final_error"]),
            f"invariance    {self.invariance}",
            "",
            f"(E) {model.claim.statement()}",
            "",
            f"Written to {path}. Ask with: parc-jax solve {path} SCENE.toml --out answer.json",
        ])  # fmt: skip


def from_system(system, study: Study, seed: int, gap: float, work: Path, quiet: bool) -> Learned:
    """Learn a black box. Finished chunks stay in `work`, so a stopped run continues. Raises InputError."""
    key = jax.random.PRNGKey(seed)
    invariance = tested(system, key, gap)
    data = collect(system, key, study.rollouts, Stage.TRAIN, path=work / "train.npz", quiet=quiet)
    net, fit = train_report(data, study.hidden, key=key, seeds=study.seeds, steps=study.steps)
    claim = bound_error(
        net, system, key, study.eps, study.delta, study.bins, train=data, path=work / "bound", quiet=quiet
    )  # fmt: skip
    return Learned(trajectory_model(net, claim, system.domain, system.time, system.name), data, fit, invariance)


def from_logs(path: Path, times: tuple, study: Study, holdout: float, seed: int) -> Learned:
    """Learn recorded runs: a random part for training, the rest for the bound. Raises InputError."""
    dt, t_f, dt_record = times
    if not 0 < holdout < 1:
        raise InputError(f"holdout: expected a share between 0 and 1; got {holdout}.")
    if (dt is None) != (t_f is None):
        raise InputError("dt, t-f: expected both, the time between knots and the length of a run in seconds.")
    data = load_rollouts(path, None if dt is None else time_grid(dt, t_f, dt_record))
    order = np.random.default_rng(seed).permutation(data.n)
    n_holdout = round(holdout * data.n)
    held, train = data.select(np.sort(order[:n_holdout])), data.select(np.sort(order[n_holdout:]))
    if not held.n or not train.n:
        raise InputError(f"{path}: expected enough runs for training and a holdout; got {data.n}.")
    net, fit = train_report(train, study.hidden, key=jax.random.PRNGKey(seed), seeds=study.seeds, steps=study.steps)
    claim = bound_error(net, held, None, study.eps, study.delta, study.bins, train=train)
    model = trajectory_model(net, claim, data.domain, data.time, data.name)
    return Learned(model, train, fit, "assumed: recorded runs cannot be started elsewhere")


def tested(system, key: jax.Array, largest: float) -> str:
    """One sentence on translation invariance, measured where the system can start elsewhere. Raises InputError."""
    if not can_start_elsewhere(system):
        return "assumed: the system offers no rollout_from(key, k, p0), so it was not measured"
    few = collect(system, key, STARTS, Stage.SEARCH, quiet=True)
    reach = np.nanmax(np.abs(np.where(np.isfinite(few.p), few.p, np.nan)), initial=0.0, axis=None)
    rng = np.random.default_rng(np.asarray(jax.random.key_data(key), np.uint32))
    starts = FAR * max(float(reach), 1.0) * rng.uniform(-1, 1, (STARTS, system.n_p))
    found = translation_gap(system, key, starts)
    worst = float(max(found.p.max(), found.q.max(initial=0.0)))
    if worst > largest:
        raise InputError(
            f"{system.name}: expected runs that do not depend on where they start; moving the start by up to "
            f"{np.abs(starts).max():.3g} m moved the offsets by {found.p.max():.3g} m and the final states by "
            f"{found.q.max(initial=0.0):.3g}. Learn where the start does not matter, or accept it with --gap."
        )
    return f"measured: runs from {STARTS} other starts differ by at most {worst:.2g}"
