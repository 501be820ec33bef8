"""One number per run: by what factor the shape must grow to hold the whole run. [T1]"""

from dataclasses import dataclass

import numpy as np

from parc_jax.error.measure import Errors, allowance, measure, measure_arrays
from parc_jax.error.tube import Tube
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.rollout.collect import k_law, map_rows, seed_of, simulate_rows
from parc_jax.rollout.law import LawSpec, law_of


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of n runs against a shape: S = max over coordinates of |error| / shape; infinite for a failed run.

    rows (n,), k (n, n_k), score (n,) float64; worst (n,) int32: coordinate of the maximum, intervals (t, p) first, then
    final; ids (n,) content hashes, or None when the runs were streamed and never held (rows of a seed are unique).
    law, seed, stage: where the runs come from.
    """

    rows: np.ndarray
    k: np.ndarray
    score: np.ndarray
    worst: np.ndarray
    ids: np.ndarray | None
    law: LawSpec
    seed: tuple[int, ...] | None
    stage: int | None

    @property
    def n(self) -> int:
        """Number of runs."""
        return self.score.shape[0]


def score_batch(net: ReLUNetwork, batch: RolloutBatch, shape: Tube) -> Scores:
    """Scores of runs held in memory. Raises InputError."""
    check_shape(net, shape, batch.time, batch.n_p)
    score, worst = score_errors(measure(net, batch), shape, batch.k)
    return Scores(batch.rows, batch.k, score, worst, batch.hashes(), batch.law, batch.seed, batch.stage)


def score_system(
    net: ReLUNetwork,
    system,
    key,
    shape: Tube,
    n: int,
    stage: Stage = Stage.BOUND,
    *,
    k=None,
    chunk: int | None = None,
    path=None,
    quiet: bool = False,
) -> Scores:
    """Scores of n fresh runs, never holding more than a few chunks of them; resumable when `path` (a folder) is given.

    Runs and errors stay on their device; one row of errors per run comes back. Arguments as in `collect`.
    Does not consume `key`. Raises InputError.
    """
    check_shape(net, shape, system.time, system.n_p)
    slack = allowance(net, system.domain, system.time, system.n_p)

    def work(rows, device):
        drawn, (p, q) = simulate_rows(system, key, stage, rows, k, 0, device)
        score, worst = score_errors(measure_arrays(net, slack, system.time, drawn, p, q), shape, drawn)
        return {"k": drawn, "score": score, "worst": worst}

    label = {"what": "scores", "network": net.hash, "shape": shape.hash}
    parts = list(map_rows(work, system, key, n, stage, k=k, chunk=chunk, path=path, quiet=quiet, label=label))
    rows = np.concatenate([rows for rows, _ in parts])
    columns = {name: np.concatenate([arrays[name] for _, arrays in parts]) for name in ("k", "score", "worst")}
    return Scores(rows, **columns, ids=None, law=law_of(system, k_law(k)), seed=seed_of(key), stage=int(stage))


def score_errors(errors: Errors, shape: Tube, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Scores (n,) and worst coordinates (n,) of measured errors of runs with parameters k (n, n_k)."""
    numbers, n = bins_of(shape, k), len(k)
    flat = np.concatenate([np.asarray(errors.interval).reshape(n, -1), np.asarray(errors.final)], axis=1)
    widths = np.concatenate([shape.interval.reshape(shape.n_bins, -1), shape.final], axis=1)
    ratio = flat / widths[numbers].min(axis=1)  # a run on a shared edge must fit every bin it touches
    return ratio.max(axis=1), ratio.argmax(axis=1).astype(np.int32)


def check_shape(net: ReLUNetwork, shape: Tube, time, n_p: int) -> None:
    """Refuse a shape that does not fit the network, or has a zero or infinite width. Raises InputError."""
    T, n_end = time.n_steps, net.n_out - (time.n_steps - 1) * n_p
    if shape.interval.shape[1:] != (T, n_p) or shape.final.shape[1] != n_end or len(shape.edges) != net.n_in:
        raise InputError(
            f"shape: expected interval (bins, {T}, {n_p}), final (bins, {n_end}), edges for {net.n_in} axes; "
            f"got {shape.interval.shape}, {shape.final.shape}, {len(shape.edges)} axes."
        )
    widths = np.concatenate([shape.interval.reshape(-1), shape.final.reshape(-1)])
    if not (np.isfinite(widths).all() and (widths > 0).all()):
        raise InputError("shape: expected finite widths > 0 (a floor); a zero width would make any error infinite.")


def bins_of(shape: Tube, k: np.ndarray) -> np.ndarray:
    """(n, c) numbers of all closed bins that contain k (n, n_k); c is 1 unless a row lies exactly on an inner edge.

    Raises InputError for a k outside every bin.
    """
    k, numbers = np.asarray(k, np.float64), np.zeros((len(k), 1), int)
    for axis, edge in enumerate(shape.edges):
        last = len(edge) - 2
        right = np.clip(np.searchsorted(edge, k[:, axis], side="right") - 1, 0, last)
        left = np.clip(np.searchsorted(edge, k[:, axis], side="left") - 1, 0, last)
        outside = ~((k[:, axis] >= edge[0]) & (k[:, axis] <= edge[-1]))
        if outside.any():
            row = int(np.argmax(outside))
            raise InputError(
                f"bins: k row {row} = {k[row]} falls in no bin; axis {axis} covers [{edge[0]}, {edge[-1]}]."
            )
        choices = [right] if (left == right).all() else [right, left]
        numbers = np.concatenate([numbers * (last + 1) + choice[:, None] for choice in choices], axis=1)
    return numbers
