"""An error scale that depends on k: a small ReLU network k -> (sigma_c(k)), one output per
coordinate of the tube.

The head is fitted to the sizes of errors on runs that come before the holdout, and then turned into
a profile: on a grid of bins, the largest value of every sigma_c over the bin, found at the vertices
    of the head's own linear regions. From
there on it is a tube like any other: the holdout gives its one scalar, so certificates and the
checker know nothing of heads. A badly fitted head costs tightness and nothing else, since any
profile fixed before the holdout is valid. [T1]
"""

import itertools

import jax
import numpy as np

from parc_jax.claim.measure import Errors
from parc_jax.claim.profile import edges_of
from parc_jax.claim.tube import Tube, tube
from parc_jax.network.predict import outputs
from parc_jax.network.relu import ReLUNetwork
from parc_jax.network.tail import fit_tail_arrays
from parc_jax.network.train import fit
from parc_jax.pwa.subdivide import enumerate_regions
from parc_jax.sets.box import Box
from parc_jax.tolerances import TOLERANCES

POWER = 8.0  # of the last layer's fit: the head lies near half of the largest error at every k
# [largest error of the coordinate] sigma is no smaller: where a head says nothing, one run would be
# all
LEAST = 0.05
SEEDS = 2
STEPS = 2000


def scale_profile(
    k: np.ndarray,
    errors: Errors,
    domain: Box,
    bins,
    hidden: tuple[int, ...],
    key: jax.Array,
    n_points: int = 1,
    floor: float = TOLERANCES.profile_floor,
) -> Tube:
    """A profile from parameters k (n, n_k) and measured, finite errors, through a head with these
    hidden layers.

    bins: numbers or edges per axis of K, as in `edges_of`. n_points: reference points whose
    coordinates are the columns of the errors. floor: [m, rad]. Uses the FIT stream of
        `key`.
    Raises InputError.
    """
    edges = edges_of(domain, bins)
    sizes = np.concatenate([np.asarray(e, np.float64).reshape(len(k), -1) for e in errors], axis=1)
    n_steps, n_c = errors.interval.shape[1:]
    largest = upper_bounds(fit_scale(k, sizes, n_steps * n_c, hidden, key), edges)
    widths = np.maximum(largest, LEAST * sizes.max(axis=0)) + floor
    interval = widths[:, : n_steps * n_c].reshape(-1, n_steps, n_c)
    return tube(edges, interval, widths[:, n_steps * n_c :], n_points)


def fit_scale(
    k: np.ndarray, sizes: np.ndarray, n_interval: int, hidden: tuple[int, ...], key
) -> ReLUNetwork:
    """The head from k (n, n_k) and error sizes (n, m), the first n_interval of them in one unit
    [m].
    """
    head = fit(k, sizes, n_interval, hidden, key=key, seeds=SEEDS, steps=STEPS)[0]
    return fit_tail_arrays(head, k, sizes, POWER)


def upper_bounds(head: ReLUNetwork, edges) -> np.ndarray:
    """(n_bins, m) largest output over every bin, row-major: an affine piece takes it at a vertex of
    its region.
    """
    return np.array(
        [
            outputs(
                head, np.asarray(enumerate_regions(head, Box(*np.transpose(sides))).points)
            ).max(axis=0)
            for sides in itertools.product(*(list(itertools.pairwise(e)) for e in edges))
        ]
    )
