"""Where plans may end, bin by bin: the goal's box less the final error of the bin. [T15]"""

from typing import NamedTuple

import numpy as np

from parc_jax.common.arrays import once
from parc_jax.learning.bound.tube import Tube
from parc_jax.safe_set.verdict.scene import Scene


class BinEnds(NamedTuple):
    """One box of k and one of ends per bin; a plan that reaches the goal is in one of these.

    k_lo, k_hi (n_bins, n_k), z_lo, z_hi (n_bins, n_p). volume (n_bins,): of both boxes together,
    nothing where no end fits or nothing is claimed.
    """

    k_lo: np.ndarray
    k_hi: np.ndarray
    z_lo: np.ndarray
    z_hi: np.ndarray
    volume: np.ndarray


def ends_of(scene: Scene) -> BinEnds:
    """The ends that the goal of a scene allows."""
    k_lo, k_hi, least, most = once(scene.model.tube, _about)
    z_lo, z_hi = scene.z_lo - least, scene.z_hi - most
    with np.errstate(invalid="ignore"):  # a bin without claim has an infinite error: no ends at all
        ends = np.where((z_lo < z_hi).all(axis=1), np.prod(z_hi - z_lo, axis=1), 0.0)
    return BinEnds(k_lo, k_hi, z_lo, z_hi, ends * np.prod(k_hi - k_lo, axis=1))


def _about(tube: Tube) -> tuple:
    """What does not depend on the scene: corners of the bins, extent of the errors at the end."""
    boxes = [tube.bin_box(b) for b in range(tube.n_bins)]
    corners = [np.array(side) for side in zip(*boxes, strict=True)]
    return *corners, *tube.end_extent
