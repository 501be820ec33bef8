"""Which recording a run is part of: runs of one recording count as one."""

import hashlib

import numpy as np

from parc_jax.common.errors import InputError

NAMED = 1 << 62  # numbers of groups that have names; below it they have nothing but a number


def group_numbers(groups, n: int) -> np.ndarray | None:
    """Names of groups as int64: whole numbers as they are, texts by their hash, equal in every
    file, from NAMED on. Raises InputError.
    """
    if groups is None:
        return None
    names = np.asarray(groups)
    if names.shape != (n,) or names.dtype.kind not in "iuUS":
        raise InputError(
            f"groups: expected a whole number or a name for each of {n} rows; got "
            f"{names.dtype} of shape {names.shape}."
        )
    if names.dtype.kind in "iu":
        return names.astype(np.int64)
    return np.array(
        [
            NAMED + int.from_bytes(hashlib.sha256(name.encode()).digest()[:7])
            for name in names.astype(str).tolist()
        ],
        np.int64,
    )


def worst_by_group(values: np.ndarray, groups: np.ndarray | None) -> np.ndarray:
    """The largest of the values (n,) of every group, in the order in which groups first appear;
    all of them without groups.
    """
    if groups is None:
        return values
    _, first, number = np.unique(groups, return_index=True, return_inverse=True)
    worst = values[first].copy()
    np.maximum.at(worst, number.ravel(), values)
    return worst[np.argsort(first, kind="stable")]
