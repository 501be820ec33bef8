"""A tube that allows for a start anywhere in a box. [T21]"""

import numpy as np

from parc_jax.claim.tube import Tube, fitted_tube, tube


def moved_tube(given: Tube, start: np.ndarray) -> Tube:
    """The tube of all points that move by the same vector within half widths start (n_p,) [m],
    before the end: there the goal shrinks instead, which knows that they move alike.
    """
    if not start.any():
        return given
    if given.templates is None:
        wide = given.interval + np.tile(start, given.n_points)
        return tube(given.edges, np.nextafter(wide, np.inf), given.final, given.n_points)
    during, at_end = given.templates
    half = np.nextafter(during.half + during.half_around(start), np.inf)
    return fitted_tube(given.edges, during.with_half(half), at_end)
