"""Black box -> batches of recorded runs, resumable and independent of chunking."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import jax
import numpy as np

from parc_jax.distributed import gather
from parc_jax.keys import Stage
from parc_jax.labels import labels_of
from parc_jax.rollout.batch import RolloutBatch, concatenate, rollout_batch
from parc_jax.rollout.files import save_rollouts
from parc_jax.rollout.forecast import Forecast
from parc_jax.rollout.identity import identity_of
from parc_jax.rollout.law import law_of
from parc_jax.rollout.resume import finished, require_same_runs
from parc_jax.rollout.rows import (
    chunk_of,
    is_given,
    k_law,
    map_rows,
    rows_again,
    seed_of,
    simulate_rows,
)
from parc_jax.system import points_of, rotation_of


def collect(
    system,
    key: jax.Array,
    n: int,
    stage: Stage = Stage.TRAIN,
    *,
    k=None,
    first_row=0,
    dtype=np.float64,
    chunk=None,
    path=None,
    quiet=False,
    forecast: Forecast | None = None,
) -> RolloutBatch:
    """Run the system n times. Row i depends on (key, stage, i) alone.

    Does not consume `key`: other stages draw from it too, and never meet these numbers.
    k: None = uniform on the domain; (n_k,) = the same for all; (n, n_k) = as given; a function key
        -> (n_k,) = its law.
    first_row: number of the first row, to continue a stream. dtype: storage of p, float64 or
        float32.
    chunk: runs per compiled call. Same chunk, same bits; another chunk may round differently in the
        last digit.
    path: an .npz file. Finished chunks are kept beside it, so a killed run continues where it was;
        an existing file of the same work is loaded. Either way the first of the stored runs are
        simulated again: a system that does not repeat them is refused.
    quiet: no progress bar, and no word about the cost. forecast: of a longer work that these runs
        are part of. Raises InputError.
    """
    identity = identity_of(system) | {"law": law_of(system, k_law(k)).hash}
    if path is not None and all(gather(Path(path).exists())):
        return _finished(system, key, n, stage, k, first_row, dtype, path, identity)
    parts = None if path is None else Path(f"{path}.parts")
    chunk = chunk_of(system, n, chunk, parts)
    stream = stream_rollouts(
        system,
        key,
        n,
        stage,
        k=k,
        first_row=first_row,
        dtype=dtype,
        chunk=chunk,
        path=parts,
        quiet=quiet,
        forecast=forecast,
    )
    batch = concatenate(stream)
    if parts is not None:
        save_rollouts(path, batch, {"system": identity, "chunk": chunk})
        shutil.rmtree(parts, ignore_errors=True)  # hosts may share the folder
    return batch


def _finished(system, key, n, stage, k, first_row, dtype, path, identity) -> RolloutBatch:
    """The rollouts of a finished file, after some of them have been simulated again."""
    asked = {
        "n": n,
        "first_row": first_row,
        "seed": seed_of(key),
        "stage": int(stage),
        "dtype": np.dtype(dtype).name,
        "k": k if is_given(k) else None,
    }
    batch, chunk = finished(path, identity, asked)
    rows = first_row + np.arange(rows_again(system, chunk or chunk_of(system, n, None, None)))
    drawn, trajectory = simulate_rows(system, key, stage, rows, k, first_row)
    shown = min(len(rows), n)
    stored = {"k": batch.k[:shown], "p": batch.p[:shown], "q": batch.q[:shown]}
    again = {"k": drawn[:shown], "p": np.asarray(trajectory.p)[:shown]}
    again["q"] = np.asarray(trajectory.q)[:shown]
    require_same_runs(path, stored, again, getattr(system, "dtype", np.float64))
    return replace(batch, rotation=rotation_of(system), labels=labels_of(system))


def stream_rollouts(
    system,
    key: jax.Array,
    n: int,
    stage: Stage = Stage.TRAIN,
    *,
    k=None,
    first_row=0,
    dtype=np.float64,
    chunk=None,
    path=None,
    quiet=False,
    forecast: Forecast | None = None,
) -> Iterator[RolloutBatch]:
    """The batches of `collect` chunk by chunk, in order, in bounded memory. path: a folder that
    keeps the chunks.
    """
    law, seed = law_of(system, k_law(k)), seed_of(key)

    def work(rows, device):
        drawn, trajectory = simulate_rows(system, key, stage, rows, k, first_row, device)
        return {
            "k": drawn,
            "p": np.asarray(trajectory.p, dtype),
            "q": np.asarray(trajectory.q, np.float64),
        }

    label = {"what": "rollouts", "dtype": np.dtype(dtype).name}
    for rows, arrays in map_rows(
        work,
        system,
        key,
        n,
        stage,
        k=k,
        first_row=first_row,
        chunk=chunk,
        path=path,
        quiet=quiet,
        forecast=forecast,
        label=label,
    ):
        yield rollout_batch(
            **arrays,
            time=system.time,
            domain=system.domain,
            law=law,
            rows=rows,
            seed=seed,
            stage=int(stage),
            points=points_of(system),
            rotation=rotation_of(system),
            labels=labels_of(system),
        )
