"""Work that goes on where it was: only with the system that it was begun with."""

import json
from pathlib import Path

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.spelling import hex_text
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.files import read_npz, rollouts_from_npz


def require_same_runs(where, stored: dict, again: dict, system) -> None:
    """Refuse stored runs that the system does not repeat. Raises InputError.

    stored, again: arrays of rows, from the disk and simulated just now; those beyond the last of
    either are left out. Another machine may round differently, hence `TOLERANCES.resumed`.
    """
    single = np.dtype(getattr(system, "dtype", np.float64)) == np.float32
    within = TOLERANCES.resumed_single if single else TOLERANCES.resumed
    kept = max(map(len, stored.values()))
    for name, old in stored.items():
        if not np.issubdtype(old.dtype, np.floating):
            continue
        new = np.asarray(again[name])[:kept]
        old = old[: len(new)]
        same = old.shape == new.shape and np.isclose(
            new, old, rtol=within, atol=within, equal_nan=True
        )
        if not np.all(same):
            raise InputError(
                f"{where}: expected the stored runs to repeat themselves; simulated again, their "
                f"{name} comes out differently. The simulator has changed, or draws randomness "
                "that does not come from the key. Delete it or choose another path."
            )


def finished(path, identity: dict, work: dict) -> tuple[RolloutBatch, int | None]:
    """The batch of a finished file and its chunk size. Raises InputError when it holds other runs
    than asked for.

    identity: of the system. work: further facts that must agree: n, first_row, seed, stage, dtype,
    k (as given, else None), law.
    """
    arrays = read_npz(path)
    batch = rollouts_from_npz(path, arrays)
    made_by = json.loads(str(arrays["meta"])).get("made_by") or {}
    time = batch.time
    have = {
        "law": batch.law.hash,
        "grid": hex_text((time.dt, time.t_f, time.dt_record)),
        "n_p": batch.n_p,
        "n_q": batch.n_q,
        "points": list(batch.points),
    } | made_by.get("system", {})
    differs = {name for name, value in have.items() if identity.get(name) != value}
    facts = {
        "n": batch.n,
        "first_row": int(batch.rows[0]),
        "seed": batch.seed,
        "stage": batch.stage,
        "dtype": batch.p.dtype.name,
    }
    differs |= {name for name, value in facts.items() if work[name] != value}
    if work["k"] is not None and not (batch.k == np.asarray(work["k"], np.float64)).all():
        differs.add("k")
    if differs:
        raise InputError(
            f"{path}: holds other rollouts than the ones asked for; expected the same "
            f"{', '.join(sorted(differs))}. Delete it or choose another path."
        )
    return batch, made_by.get("chunk")


def refuse_other_work(folder: Path, stored: dict, wanted: dict) -> None:
    """Refuse a folder whose description differs. Raises InputError."""
    differs = sorted(
        name for name in wanted.keys() | stored.keys() if wanted.get(name) != stored.get(name)
    )
    if differs:
        raise InputError(
            f"{folder}: holds chunks of other work; expected the same {', '.join(differs)}. "
            "Delete the folder or choose another path."
        )
