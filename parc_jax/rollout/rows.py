"""Work on numbered rows of a random stream: in chunks, on several workers, resumable, in order."""

import logging
import time
from collections.abc import Iterator

import jax
import numpy as np

from parc_jax.arrays import content_hash
from parc_jax.distributed import gather, rank_and_size, require_same
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.rollout.chunks import Arrays, ChunkStore, default_chunk, run_chunks, worker_devices
from parc_jax.rollout.forecast import Forecast, Pace
from parc_jax.rollout.identity import identity_of
from parc_jax.rollout.law import law_of
from parc_jax.rollout.resume import require_same_runs
from parc_jax.rollout.simulate import is_traceable, remembered, simulator
from parc_jax.rollout.user_code import blamed
from parc_jax.system import check_system

_log = logging.getLogger(__name__)


def simulate_rows(system, key, stage: Stage, rows: np.ndarray, k=None, first_row=0, device=None):
    """Run the given global rows (B,). Returns k (B, n_k) on the host and the Trajectory (B, ...) on
    the device, its p as columns (B, n_record + 1, n_c).
    """
    sim = simulator(system)
    if is_given(k) and np.ndim(k) == 2:
        # padding rows beyond the list repeat its last entry; they are cut off again
        k = np.asarray(k, np.float64)[np.minimum(rows - first_row, len(k) - 1)]
    drawn = sim.rows(key, stage, rows, k)
    return drawn.k, sim.run(drawn, device)


def map_rows(
    work,
    system,
    key,
    n: int,
    stage: Stage,
    *,
    k=None,
    first_row=0,
    chunk=None,
    path=None,
    quiet=False,
    title: str | None = None,
    forecast: Forecast | None = None,
    label: dict,
) -> Iterator[tuple[np.ndarray, Arrays]]:
    """Apply work(rows (chunk,), device) -> arrays (chunk, ...) to n rows of a stream; yields (rows,
    arrays) without padding.

    The general form of `stream_rollouts`: results stream in order, several workers, resumable when
    `path` (a folder) is given; `label` says what the work is, so that a folder is never continued
    with other work. title: of the progress bar. Raises InputError, also when the system changes
    while it runs.
    """
    from tqdm import tqdm

    if n < 1:
        raise InputError(f"rollouts: expected n >= 1; got {n}.")
    check_system(system)
    _check_k(system, n, k)
    devices = worker_devices(system)
    chunk = chunk_of(system, n, chunk, path)
    law = law_of(system, k_law(k)).hash
    grid = system.time
    identity = identity_of(system) | {"law": law}
    meta = (
        label
        | identity
        | {
            "seed": list(seed_of(key)),
            "stage": int(stage),
            "first_row": first_row,
            "chunk": chunk,
            "k": content_hash(k) if is_given(k) else "",
        }
    )
    require_same(f"{label['what']} of {n} rows", meta)
    chunk_rows = [np.arange(first_row + i, first_row + i + chunk) for i in range(0, n, chunk)]
    sim = simulator(system)
    if not sim.traceable:  # needs no fixed shape: do not run what will be cut off
        chunk_rows[-1] = chunk_rows[-1][chunk_rows[-1] < first_row + n]
    store = None
    if path is not None:
        store = ChunkStore(path, meta)
        _require_same_chunk(store, system, work, chunk_rows, devices[0])
    forecast = forecast or Forecast(n)
    pace = Pace(len(devices) * rank_and_size()[1], compiles=sim.traceable)
    quiet = quiet or rank_and_size()[0] > 0

    def one(index, device):
        began = time.perf_counter()
        with blamed(f"{system.name}: expected the system to run"):
            arrays = work(chunk_rows[index], device)
        each = pace.of(len(chunk_rows[index]), began, time.perf_counter())
        if each is not None and not quiet:
            forecast.measured(system.name, each)
        face = (law_of(system, k_law(k)).hash, system.time)
        if face != (law, grid) or remembered(system).content != sim.content:
            raise InputError(
                f"{system.name}: expected a system that stays as it is while it runs; it was "
                "changed. Make another one instead."
            )
        return arrays

    title = f"{system.name}: {title or _title(stage, first_row)}"
    _log.info("%s: %d rows in %d chunks", title, n, len(chunk_rows))
    with tqdm(total=n, unit="rollout", desc=title, disable=quiet) as bar:
        for rows, arrays in zip(
            chunk_rows, run_chunks(one, len(chunk_rows), devices, store), strict=True
        ):
            kept = min(chunk, first_row + n - int(rows[0]))
            _log.debug("%s: rows %d to %d", title, rows[0], rows[0] + kept - 1)
            bar.update(kept)
            yield rows[:kept], {name: array[:kept] for name, array in arrays.items()}


def chunk_of(system, n: int, chunk: int | None, path) -> int:
    """Runs per call; hosts may differ in cores and in what they have on disk: the first decides."""
    if path is not None:
        chunk = chunk or ChunkStore.stored_chunk(path)
    chunk = chunk or getattr(system, "chunk", None)
    return gather(int(chunk or default_chunk(system, n, len(worker_devices(system)))))[0]


def rows_again(system, chunk: int) -> int:
    """How many runs to repeat before stored ones are believed: a compiled chunk as a whole, for
    the same bits; one run of anything else.
    """
    return chunk if is_traceable(system) else 1


def _require_same_chunk(store: ChunkStore, system, work, chunk_rows, device) -> None:
    """Run stored rows again and compare. Raises InputError."""
    known = store.first()
    if known is None or known[0] >= len(chunk_rows):
        return
    index, stored = known
    rows = chunk_rows[index][: rows_again(system, len(chunk_rows[index]))]
    with blamed(f"{system.name}: expected the system to run"):
        again = work(rows, device)
    shown = min(len(rows), len(stored["k"]))
    require_same_runs(
        store.folder,
        {name: array[:shown] for name, array in stored.items()},
        {name: np.asarray(array)[:shown] for name, array in again.items()},
        getattr(system, "dtype", np.float64),
    )


def _title(stage: Stage, first_row: int) -> str:
    """What the runs are for, in words; no two stages share them."""
    if stage == Stage.TRAIN and first_row:
        return "further runs for the profile"
    return {
        Stage.TRAIN: "training runs",
        Stage.BOUND: "fresh runs for the bound",
        Stage.SEARCH: "runs of the search",
        Stage.REPLAY: "replay",
        Stage.VALIDATE: "validation",
    }.get(stage, Stage(stage).name.lower())


def k_law(k) -> str:
    """Name of the law of k for a LawSpec."""
    if k is None:
        return "uniform"
    return getattr(k, "__name__", type(k).__name__) if callable(k) else "given"


def seed_of(key) -> tuple[int, ...]:
    """The data of a random key, as plain numbers: part of the identity of every row."""
    data = (
        jax.random.key_data(key) if jax.dtypes.issubdtype(key.dtype, jax.dtypes.prng_key) else key
    )
    return tuple(int(v) for v in np.asarray(data).ravel())


def is_given(k) -> bool:
    return k is not None and not callable(k)


def _check_k(system, n: int, k) -> None:
    if not is_given(k):
        return
    shape = np.shape(k)
    if shape not in ((system.domain.n,), (n, system.domain.n)):
        raise InputError(
            f"rollouts k: expected ({system.domain.n},), ({n}, {system.domain.n}) or a function; "
            f"got {shape}."
        )
    if not system.domain.contains(np.asarray(k)).all():
        raise InputError(
            f"rollouts k: expected every k inside the domain {system.domain.lo} .. "
            f"{system.domain.hi}."
        )
