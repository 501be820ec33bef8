"""What `learn` does: the learning of the main job, for one network; from a system or from logged runs."""

import json
from dataclasses import replace
from pathlib import Path

import jax
import numpy as np

from parc_jax.errors import InputError
from parc_jax.network.train import evaluate, training_arrays
from parc_jax.rollout.loaders import load_rollouts
from parc_jax.study.learn import Lesson, final_error, learn, learn_recorded
from parc_jax.study.settings import Study, name_of
from parc_jax.study.stopwatch import Stopwatch
from parc_jax.system import time_grid


def from_system(system, study: Study, seed: int, work: Path, quiet: bool) -> Lesson:
    """Learn a black box. Finished chunks stay in `work`, so a stopped run continues. Raises InputError."""
    return learn(system, replace(study, others=()), jax.random.PRNGKey(seed), Stopwatch(), work, quiet)


def from_logs(path: Path, times: tuple, study: Study, holdout: float, seed: int) -> Lesson:
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
    return learn_recorded(train, held, replace(study, others=()), jax.random.PRNGKey(seed))


def told(lesson: Lesson, path: Path, as_json: bool = False) -> str:
    """The main model for a terminal, or as JSON."""
    model, failed = lesson.main, int(lesson.train.failed.sum())
    k, y = training_arrays(lesson.train)
    rms = float(np.sqrt(((evaluate(model.net, k) - y) ** 2).mean()))
    facts = {
        "model": str(path), "system": model.system, "rollouts": lesson.train.n, "failed": failed,
        "hidden": list(model.net.hidden), "training_rms": rms, "final_error": final_error(model).tolist(),
        "bins": model.tube.n_bins, "start": lesson.start.statement(), "claim": model.claim.to_json(),
    }  # fmt: skip
    if as_json:
        return json.dumps(facts, indent=1)
    return "\n".join([
        f"system        {model.system}",
        f"rollouts      {lesson.train.n} for training, {failed} of them failed",
        f"network       {name_of(model.net.hidden)}, rms error {rms:.3g} on the training runs",
        f"tube          {model.tube.n_bins} bins; at the end, median over K: "
        + ", ".join(f"±{v:.3g}" for v in facts["final_error"]),
        f"invariance    {lesson.start.statement()}",
        "",
        f"(E) {model.claim.statement()}",
        "",
        f"Written to {path}. Ask with: parc-jax solve {path} SCENE.toml --out answer.json",
    ])  # fmt: skip
