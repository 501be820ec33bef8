"""A ground robot as a twist of its body that k decides: a prior of a few dozen numbers."""

import itertools

import numpy as np

from parc_jax.learning.runs.subject import Subject
from parc_jax.learning.system import TimeGrid, Trajectory

FINE = 64  # steps, at least, in which a twist is integrated


class TwistModel:
    """A black box without disturbance: the body moves ahead, to its left and turns as k says, and
    its reference points with it.

    about: what the runs are about, whose domain, time grid and points it has. order: of the
    polynomials in k. gain (degree + 1, n_terms, 3): of every Legendre polynomial of time and every
    monomial of the scaled k, to (ahead, left [m/s], turning [rad/s]). places (n_points, 2) [m]: of
    the reference points in the body at the start, the first at 0. goal (n_terms, n_q): of the
    further goal states.
    """

    n_p = 2

    def __init__(self, about: Subject, order: int, gain, places, goal):
        self.name = f"{about.system}, twist"
        self.domain = about.domain
        self.time = about.time
        self.points = about.points
        self.n_q = goal.shape[1]
        self.order = order
        self.gain = gain
        self.places = places
        self.goal = goal

    def rollout_batch(self, keys, ks) -> Trajectory:
        """k (B, n_k) -> p (B, n_record + 1, n_points, 2) [m], no axis of one point, q (B, n_q)."""
        del keys
        terms = monomials(self.domain, self.order, np.asarray(ks))
        p = driven(self.time, terms, self.gain, self.places)
        return Trajectory(p[:, :, 0] if len(self.points) == 1 else p, terms @ self.goal)


def monomials(domain, order: int, k: np.ndarray) -> np.ndarray:
    """All monomials (n, n_terms) up to an order of k (n, n_k), scaled from K to [-1, 1]."""
    x = (2 * k - domain.lo - domain.hi) / (domain.hi - domain.lo)
    chosen = (
        list(axes)
        for degree in range(order + 1)
        for axes in itertools.combinations_with_replacement(range(domain.n), degree)
    )
    return np.stack([x[:, axes].prod(axis=1) for axes in chosen], axis=1)


def driven(time: TimeGrid, terms: np.ndarray, gain: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Places (n, n_record + 1, n_points, 2) of the points of runs with these terms (n, n_terms)."""
    shape = basis(time, len(gain))
    ahead, left, turning = np.einsum("tj,jac,na->cnt", shape, gain, terms)
    heading = integrated(time, turning)
    turned = np.exp(1j * heading)
    way = integrated(time, (ahead + 1j * left) * turned)[:, :: _within(time)]
    offsets = places @ np.array([1.0, 1j])
    at = way[..., None] + turned[:, :: _within(time), None] * offsets
    return np.stack([at.real, at.imag], axis=-1)


def basis(time: TimeGrid, n: int) -> np.ndarray:
    """The first n Legendre polynomials over [0, t_f] at the fine times (n_fine + 1, n)."""
    return np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, _fine(time) + 1), n - 1)


def integrated(time: TimeGrid, rate: np.ndarray) -> np.ndarray:
    """Integral from 0 of a rate (..., n_fine + 1), at the fine times."""
    from scipy.integrate import cumulative_simpson

    return cumulative_simpson(rate, dx=time.t_f / _fine(time), axis=-1, initial=0)


def at_fine_times(time: TimeGrid, recorded: np.ndarray) -> np.ndarray:
    """Records (n, n_record + 1) interpolated at the fine times (n, n_fine + 1)."""
    fine, records = np.linspace(0, 1, _fine(time) + 1), np.linspace(0, 1, time.n_record + 1)
    return np.stack([np.interp(fine, records, run) for run in recorded])


def at_records(time: TimeGrid, fine: np.ndarray) -> np.ndarray:
    """Of values (..., n_fine + 1) at the fine times those at the records."""
    return fine[..., :: _within(time)]


def _within(time: TimeGrid) -> int:
    """Fine steps from one record to the next; an even number, as Simpson's rule likes it."""
    return 2 * int(np.ceil(FINE / time.n_record / 2))


def _fine(time: TimeGrid) -> int:
    return time.n_record * _within(time)
