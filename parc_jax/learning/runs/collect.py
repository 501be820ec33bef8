"""Black box -> batches of recorded runs, resumable and independent of chunking."""

import logging
import shutil
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import jax
import numpy as np

from parc_jax.common.arrays import content_hash
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.learning.labels import labels_of
from parc_jax.learning.runs.batch import RolloutBatch, concatenate, rollout_batch
from parc_jax.learning.runs.chunks import Arrays, ChunkStore, run_chunks, worker_devices
from parc_jax.learning.runs.files import save_rollouts
from parc_jax.learning.runs.forecast import Forecast, Pace
from parc_jax.learning.runs.law import LawSpec, law_of
from parc_jax.learning.runs.resume import finished, require_same_runs
from parc_jax.learning.runs.rows import (
    check_asked,
    chunk_of,
    chunks_of_rows,
    is_given,
    k_law,
    require_same_chunk,
    rows_again,
    seed_of,
    simulate_rows,
    title_of,
)
from parc_jax.learning.runs.simulate import remembered, simulator
from parc_jax.learning.runs.subject import given_of
from parc_jax.learning.system import Retried, points_of, rotation_of
from parc_jax.learning.systems.identity import identity_of
from parc_jax.learning.systems.user_code import blamed

_log = logging.getLogger(__name__)


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
        simulated again: a system that does not repeat them is refused. Runs of a system that is not
        compiled here and that were begun before the stop count as lost (`RolloutBatch.lost`).
    quiet: no progress bar, and no word about the cost. forecast: of a longer work that these runs
        are part of. Raises InputError.
    """
    check_asked(system, key, n, k)
    identity = identity_of(system) | {"law": law_of(system, k_law(system, k)).hash}
    if path is not None and Path(path).exists():
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
    batch = concatenate(stream, n)
    if parts is not None:
        save_rollouts(path, batch, {"system": identity, "chunk": chunk})
        shutil.rmtree(parts, ignore_errors=True)
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
    stored = {"k": batch.k, "p": batch.p, "q": batch.q}
    again = _simulated(system, key, stage, k, first_row, dtype, rows)
    require_same_runs(path, stored, again, system)
    return replace(
        batch, rotation=rotation_of(system), labels=labels_of(system), given=given_of(system)
    )


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
    """The batches of `collect` chunk by chunk, in order, in bounded memory, on several workers.
    path: a folder that keeps the chunks. Raises InputError, also when the system changes while it
    runs.
    """
    from tqdm import tqdm

    check_asked(system, key, n, k)
    devices = worker_devices(system)
    chunk = chunk_of(system, n, chunk, path)
    law, grid = law_of(system, k_law(system, k)), system.time
    meta = _identity(system, key, stage, k, first_row, dtype) | {"chunk": chunk}
    sim = simulator(system)
    chunks = chunks_of_rows(n, first_row, chunk, sim.traceable)
    work = partial(_simulated, system, key, stage, k, first_row, dtype)
    store = None
    if path is not None:
        store = ChunkStore(path, meta)
        require_same_chunk(store, system, work, chunks, devices[0])
    told = None if quiet else forecast or Forecast(n)
    pace = Pace(len(devices), sim.traceable, told, system.name)

    def one(index, device):
        arrays = pace.timed(len(chunks[index]), lambda: work(chunks[index], device))
        same = (law_of(system, k_law(system, k)), system.time) == (law, grid)
        if not same or remembered(system).content != sim.content:
            raise InputError(
                f"{system.name}: expected a system that stays as it is while it runs; it was "
                "changed. Make another one instead."
            )
        return arrays

    title = f"{system.name}: {title_of(stage, first_row)}"
    _log.info("%s: %d rows in %d chunks", title, n, len(chunks))
    with tqdm(total=n, unit="rollout", desc=title, disable=quiet) as bar:
        done = run_chunks(one, len(chunks), devices, store, count_losses=not sim.traceable)
        for rows, arrays in zip(chunks, done, strict=True):
            kept = min(chunk, first_row + n - int(rows[0]))
            _log.debug("%s: rows %d to %d", title, rows[0], rows[0] + kept - 1)
            bar.update(kept)
            some = {name: array[:kept] for name, array in arrays.items()}
            yield _batch(system, key, stage, law, rows=rows[:kept], **some)


def _identity(system, key, stage: Stage, k, first_row: int, dtype) -> dict:
    """What runs are those of, but for how many they are: a folder or file of others is refused."""
    return identity_of(system) | {
        "what": "rollouts",
        "dtype": np.dtype(dtype).name,
        "law": law_of(system, k_law(system, k)).hash,
        "seed": list(seed_of(key)),
        "stage": int(stage),
        "first_row": first_row,
        "k": content_hash(k) if is_given(k) else "",
    }


def _batch(system, key, stage: Stage, law: LawSpec, **arrays) -> RolloutBatch:
    """Runs of the system as a batch."""
    return rollout_batch(
        **arrays,
        time=system.time,
        domain=system.domain,
        law=law,
        seed=seed_of(key),
        stage=int(stage),
        points=points_of(system),
        rotation=rotation_of(system),
        labels=labels_of(system),
        given=given_of(system),
    )


def _simulated(system, key, stage, k, first_row, dtype, rows, device=None) -> Arrays:
    """What is kept of the runs of global rows (B,)."""
    with blamed(f"{system.name}: expected the system to run"):
        drawn, trajectory = simulate_rows(system, key, stage, rows, k, first_row, device)
    p, q = np.asarray(trajectory.p, dtype), np.asarray(trajectory.q, np.float64)
    lost = {"lost": trajectory.lost} if isinstance(trajectory, Retried) else {}
    return {"k": drawn, "p": p, "q": q} | lost
