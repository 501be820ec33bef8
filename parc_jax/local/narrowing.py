"""Two tubes compared where both speak: on the box of the narrower one."""

from typing import NamedTuple

import numpy as np

from parc_jax.claim.tube import Tube
from parc_jax.sets.box import Box


class Narrowing(NamedTuple):
    """Half widths over a box of k, the widest of the bins that it meets. whole, local: of the two
    tubes at the end, (n_c + n_q,) [m, .]. times: by what factor the local one is narrower, at the
    end and during the run: geometric mean over all coordinates (and intervals); infinite where the
    other tube has no claim.
    """

    whole: np.ndarray
    local: np.ndarray
    times_end: float
    times_path: float


def narrowing(whole: Tube, local: Tube, box: Box) -> Narrowing:
    """The tubes of a model of all of K and of one of a box in it."""
    bins = [b for b in range(whole.n_bins) if _meets(whole.bin_box(b), box)]
    path, end = whole.widest(np.array(bins))
    own_path, own_end = local.widest()
    return Narrowing(end, own_end, _factor(end, own_end), _factor(path, own_path))


def _meets(bin_box: tuple[np.ndarray, np.ndarray], box: Box) -> bool:
    lo, hi = bin_box
    return bool((lo <= box.hi).all() and (hi >= box.lo).all())


def _factor(wide: np.ndarray, narrow: np.ndarray) -> float:
    if not np.isfinite(wide).all():
        return float("inf")
    if not np.isfinite(narrow).all():
        return 0.0
    return float(np.exp(np.mean(np.log(wide / narrow))))
