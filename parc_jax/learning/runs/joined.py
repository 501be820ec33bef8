"""Several batches of runs as one, where they are of one source."""

import dataclasses
import itertools
from collections.abc import Iterable

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.learning.runs.batch import BY_ROW, RolloutBatch


def joined_source(batches: Iterable) -> tuple[str, int, int]:
    """The source of several batches, or scores, of one log or seed."""
    each = [b.source or ("", int(b.rows.min()), int(b.rows.max())) for b in batches]
    logs, first, last = zip(*each, strict=True)
    return logs[0], min(first), max(last)


def concatenate(batches: Iterable[RolloutBatch], n: int | None = None) -> RolloutBatch:
    """One batch from several of the same law (and so K), time grid, reference points, rotation,
    given parameters and labels, in order. n: total number of rows, if known: then batches may be a
    stream, and are dropped when copied. Raises InputError when they differ, or have rows in common,
    as two files of one name do.
    """
    if n is None:
        batches = list(batches)
        n = sum(batch.n for batch in batches)
    batches = iter(batches)
    first = next(batches)
    parts = {x: getattr(first, x) for x in BY_ROW if x != "lost" and getattr(first, x) is not None}
    whole: dict = {name: np.empty((n, *x.shape[1:]), x.dtype) for name, x in parts.items()}
    at, lost, source = 0, np.zeros(n, np.int64), joined_source([first])
    for batch in itertools.chain([first], batches):
        one, two = _facts(first), _facts(batch)
        differs = [f"{name} ({one[name]}; {two[name]})" for name in one if one[name] != two[name]]
        if differs:
            raise InputError(
                "concatenate: expected batches of one source; they differ in "
                f"{', '.join(differs)}. Load or collect them in one way, or train and bound by one."
            )
        source = joined_source([dataclasses.replace(first, source=source), batch])
        begin, at = at, at + batch.n
        if at <= n:
            for name in whole:
                whole[name][begin:at] = getattr(batch, name)
            lost[begin:at] = 0 if batch.lost is None else batch.lost
    if at != n:
        raise InputError(f"concatenate: expected {n:,} rows in all batches together; got {at:,}.")
    if shared := n - len(np.unique(whole["rows"])):
        raise InputError(
            f"concatenate: expected each row of {first.name} once; {shared:,} of {n:,} occur "
            "again. Two files of one name number their rows, and their groups, anew: load all "
            "their runs as one folder, with a name for each recording."
        )
    return dataclasses.replace(first, **whole, lost=lost if lost.any() else None, source=source)


def _facts(batch: RolloutBatch) -> dict:
    shared = ("time", "seed", "stage", "points", "rotation", "given", "labels")
    groups = "none" if batch.groups is None else "given"
    storage = {"law": batch.law.describe(), "storage": batch.p.dtype.name, "groups": groups}
    storage |= {"log": joined_source([batch])[0][:12], "K": batch.domain.text}
    return storage | {fact: getattr(batch, fact) for fact in shared}
