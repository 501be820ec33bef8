"""Groups of runs: the recording that each is a part of. Runs of one are not independent."""

import hashlib
import re
import unicodedata

import numpy as np

from parc_jax.common.errors import InputError

# Numbers of groups that have names; below it they have nothing but a number, as those have that an
# earlier rule made of names
NAMED = 3 << 61


def group_numbers(groups, n: int) -> np.ndarray | None:
    """Names of groups as int64: whole numbers, also as text, as they are; other texts by hash,
    equal in every file, whatever the case and spaces, from NAMED on. Raises InputError, also for an
    empty name and for a fraction.
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
    return np.array([_number(name) for name in names.astype(str).tolist()], np.int64)


def _number(name: str) -> int:
    # names that differ in case, spaces, unseen marks or the form of Unicode alone are one
    seen = "".join(c for c in name if unicodedata.category(c) != "Cf")
    folded = unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", seen).casefold())
    name = " ".join(folded.split())
    whole = re.fullmatch(r"([+-]?\d{1,18})(\.0*)?", name)
    if whole:
        return int(whole[1])
    if not name or re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)", name):
        raise InputError(
            f"groups: expected names, or whole numbers, of recordings; got {name!r}. Give each "
            "recording a name with a letter in it."
        )
    return NAMED + int.from_bytes(hashlib.sha256(name.encode()).digest()[:7])


def worst_by_group(values: np.ndarray, groups: np.ndarray | None) -> np.ndarray:
    """The largest of the values (n,) of every group, in order of appearance; without groups all."""
    if groups is None:
        return values
    _, first, number = np.unique(groups, return_index=True, return_inverse=True)
    worst = values[first].copy()
    np.maximum.at(worst, number.ravel(), values)
    return worst[np.argsort(first, kind="stable")]
