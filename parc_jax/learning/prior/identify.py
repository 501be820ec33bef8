"""A prior from few real runs: a twist model, identified and corrected by their errors."""

import math
from collections.abc import Callable, Iterator
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.network.predict import by_point
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.law import Subject
from parc_jax.learning.system import TimeGrid, Trajectory

SMOOTHINGS = (0.1, 1.0, 10.0)  # [1] of thin plates over K scaled to [-1, 1]; more is stiffer
FOLDS = 5  # parts of the training runs that take turns: each is predicted from the others
CLEARLY = 2.0  # [standard errors] by which they must help
_UNLIKE_RESIDUAL = 3.0  # [median size] residuals of runs that are larger count as so large


class Corrected(NamedTuple):
    """A prior corrected by the residuals of runs.

    predicted: (n, m) places at all records and goal states at the k of the runs, as corrected.
    more: the correction, (n, m) at any k (n, n_k). smoothing: of the residuals; None without.
    errors: (n, m) of every run as predicted from the other folds. alone, best: [m] typical largest
        error of a run, by the prior and by the best of the corrections.
    """

    predicted: np.ndarray
    more: Callable[[np.ndarray], np.ndarray]
    smoothing: float | None
    errors: np.ndarray
    alone: float
    best: float

    def details(self) -> str:
        """One sentence."""
        sizes = (
            f"predicted from others, a training run is typically off by {self.alone:.2g} m by the "
            f"prior alone and by {self.best:.2g} m when their residuals correct it"
        )
        if self.smoothing is None:
            return f"residuals left out ({sizes}, which is not clearly less)"
        return f"corrected by residuals ({sizes})"


def corrected(prior: Callable[[np.ndarray], np.ndarray], runs: RolloutBatch) -> Corrected:
    """A prior, corrected by the residuals of finite runs if cross-validation shows a clear gain.

    prior: mask (n,) of the runs to fit -> predictions for all runs (n, m), as in `flat`.
    """
    truth = flat(runs)
    choices = (None, *SMOOTHINGS)
    errors = {choice: np.zeros_like(truth) for choice in choices}
    for fit, held in folds(runs):
        rest = truth - prior(fit)
        for choice in choices:
            more = _smoothed(runs.select(fit), rest[fit], choice)
            errors[choice][held] = rest[held] - more(runs.k[held])
    sizes = {choice: log_sizes(runs, of_choice) for choice, of_choice in errors.items()}
    best = min(SMOOTHINGS, key=lambda choice: sizes[choice].mean())
    less = sizes[None] - sizes[best]
    chosen = best if less.mean() > CLEARLY * less.std() / np.sqrt(len(less)) else None
    whole = prior(np.ones(runs.n, bool))
    more = _smoothed(runs, truth - whole, chosen)
    typical = (float(np.exp(sizes[choice].mean())) for choice in (None, best))
    return Corrected(whole + more(runs.k), more, chosen, errors[chosen], *typical)


def folds(runs: RolloutBatch) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Masks (n,) of the rows to fit and of those held out, in turn; groups stay together."""
    groups = np.arange(runs.n) if runs.groups is None else runs.groups
    number = np.unique(groups, return_inverse=True)[1].ravel() % FOLDS
    for part in range(FOLDS):
        if (number == part).any() and (number != part).any():
            yield number != part, number == part


def flat(runs: RolloutBatch) -> np.ndarray:
    """(n, m) places at all records, then goal states."""
    return np.concatenate([np.asarray(runs.p, np.float64).reshape(runs.n, -1), runs.q], axis=1)


def largest(runs: RolloutBatch, errors: np.ndarray) -> np.ndarray:
    """(n,) [m] the largest of the errors (n, m) of every run in a coordinate of a place."""
    return np.abs(errors[:, : errors.shape[1] - runs.n_q]).max(axis=1)


def log_sizes(runs: RolloutBatch, errors: np.ndarray) -> np.ndarray:
    """(n,) logarithms of `largest` [m], whose mean tells a typical run."""
    return np.log(largest(runs, errors) + TOLERANCES.profile_floor)


def _smoothed(runs: RolloutBatch, residual: np.ndarray, smoothing: float | None) -> Callable:
    """Residuals (n, m) of runs as a function of k."""
    if smoothing is None:
        return lambda k: np.zeros((len(k), residual.shape[1]))
    from scipy.interpolate import RBFInterpolator

    size = np.abs(residual).max(axis=1)
    # a run unlike the others shall not bend the surface
    weight = np.minimum(1.0, _UNLIKE_RESIDUAL * np.median(size) / np.maximum(size, 1e-12))
    lo, hi = runs.domain.lo, runs.domain.hi

    def in_unit(k):
        return (2 * k - lo - hi) / (hi - lo)

    tame = residual * weight[:, None]
    plates = RBFInterpolator(in_unit(runs.k), tame, smoothing=smoothing, degree=1)
    return lambda k: plates(in_unit(k))


FINE = 64  # steps, at least, in which a twist is integrated


class TwistModel:
    """A black box without disturbance: a rigid body with a twist that depends on k and time.

    about: subject of the runs; its domain, time grid and points. order: of the polynomials in k.
    gain: (degree + 1, n_terms, 3), of every Legendre polynomial of time and every monomial of the
        scaled k, to (ahead, left [m/s], turning [rad/s]).
    places: (n_points, 2) [m] of the reference points in the body at the start, the first at 0.
    goal: (n_terms, n_q), of the further goal states.
    """

    n_p = 2

    def __init__(self, about: Subject, order: int, gain, places, goal):
        self.name = f"{about.system}, twist"
        self.domain, self.time, self.points = about.domain, about.time, about.points
        self.n_q = goal.shape[1]
        self.order, self.gain, self.places, self.goal = order, gain, places, goal

    def rollout_batch(self, keys, ks) -> Trajectory:
        """k (B, n_k) -> p (B, n_record + 1, n_points, 2) [m], no axis of one point, q (B, n_q)."""
        del keys
        terms = monomials(self.domain, self.order, np.asarray(ks))
        p = driven(self.time, terms, self.gain, self.places)
        return Trajectory(p[:, :, 0] if len(self.points) == 1 else p, terms @ self.goal)


def monomials(domain: Box, order: int, k: np.ndarray) -> np.ndarray:
    """All monomials (n, n_terms) up to an order of k (n, n_k), scaled from K to [-1, 1]."""
    x = (2 * k - domain.lo - domain.hi) / (domain.hi - domain.lo)
    axes = range(domain.n)
    chosen = (combinations_with_replacement(axes, degree) for degree in range(order + 1))
    return np.stack([x[:, list(some)].prod(axis=1) for each in chosen for some in each], axis=1)


def driven(time: TimeGrid, terms: np.ndarray, gain: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Places (n, n_record + 1, n_points, 2) of reference points, from terms (n, n_terms)."""
    ahead, left, turning = np.einsum("tj,jac,na->cnt", basis(time, len(gain)), gain, terms)
    turned = np.exp(1j * integrated(time, turning))
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


def _within(time: TimeGrid) -> int:
    """Fine steps from one record to the next; an even number, for Simpson's rule."""
    return 2 * int(np.ceil(FINE / time.n_record / 2))


def _fine(time: TimeGrid) -> int:
    return time.n_record * _within(time)


ORDERS, DEGREES = (1, 2, 3), (0, 1, 2, 3)  # of polynomials in k, and in time
_LEAST = 8  # runs
_RUNS_PER_TERM = 6  # at least so many distinct k for each number of a rate
_UNLIKE = 5.0  # [median error] larger errors of a run count as so large
_LITTLE = 0.02  # [share of an error] below which a further coefficient is not worth it
_RIGID = 0.1  # [share of the body] that points may move within it and still be one body
_ROUNDS = 5  # in which runs that are unlike the others lose weight


class Motion(NamedTuple):
    """Finite runs as a moving rigid body. way: (n, n_record + 1) complex [m] of the first point.
    heading: (n, n_record + 1) [rad]. places: (n_points, 2) [m] of the points at the start.
    """

    batch: RolloutBatch
    way: np.ndarray
    heading: np.ndarray
    places: np.ndarray


class Kind(NamedTuple):
    """A family of twists: orders of the polynomials in k and in time."""

    order: int
    degree: int


def moving_body(runs: RolloutBatch) -> Motion:
    """The motion of the body in the finite runs. Raises InputError for too few runs, and for runs
    that are not of one rigid body in the plane, each in the frame of its start.
    """
    if runs.n_p != 2:
        raise InputError(
            f"prior twist: expected positions in the plane; got {runs.n_p} axes. Give a simulator."
        )
    batch = runs.finite
    if batch.n < _LEAST:
        raise InputError(
            f"prior twist: expected at least {_LEAST} finite training runs; got {batch.n} of "
            f"{runs.n}."
        )
    points = by_point(np.asarray(batch.p, np.float64), len(batch.points)) @ np.array([1.0, 1j])
    if len(batch.points) == 1:
        return Motion(batch, points[..., 0], _along(points[..., 0]), np.zeros((1, 2)))
    arms = points - points[..., :1]
    at_start = np.median(arms[:, 0].real, axis=0) + 1j * np.median(arms[:, 0].imag, axis=0)
    off = np.abs(arms[:, 0] - at_start).max(axis=1)
    size = np.abs(arms[:, 0]).max()
    if np.median(off) > _RIGID * size:
        raise InputError(
            "prior twist: expected every run in the frame in which it begins; in half of the runs "
            f"the reference points start {np.median(off):.2g} m from their usual place. Turn them."
        )
    heading = np.unwrap(np.angle(arms @ at_start.conj()), axis=1)
    bent = np.abs(arms - np.exp(1j * heading)[..., None] * at_start).max(axis=(1, 2))
    if np.median(bent) > _RIGID * size:
        raise InputError(
            "prior twist: expected reference points of one rigid body; they move against each "
            f"other by {np.median(bent):.2g} m in half of the runs. Give a simulator as the prior."
        )
    return Motion(batch, points[..., 0], heading, np.stack([at_start.real, at_start.imag], axis=1))


def _along(way: np.ndarray) -> np.ndarray:
    """Headings (n, n_record + 1) of one point without sideslip, from its way (n, n_record + 1):
    forwards or backwards, the one that begins nearer to ahead.
    """
    step = np.gradient(way, axis=1)
    moving = np.abs(step) > 0.05 * np.abs(step).max(axis=1, keepdims=True)
    headings = []
    for each, usable in zip(step, moving, strict=True):
        at = np.flatnonzero(usable)
        if not len(at):
            headings.append(np.zeros(len(each)))
            continue
        angle = np.unwrap(np.angle(each[at]), period=np.pi)
        angle -= np.pi * np.round(angle[0] / np.pi)
        headings.append(np.interp(np.arange(len(each)), at, angle))
    return np.stack(headings)


def chosen_kind(motion: Motion) -> Kind:
    """The smallest kind within a standard error of the best one, by cross-validation."""
    parts, batch = list(folds(motion.batch)), motion.batch
    n = min(len(np.unique(batch.k[fit], axis=0)) for fit, _ in parts)
    kinds = [Kind(order, degree) for order in ORDERS for degree in DEGREES]
    n_k = batch.n_k
    sizes = [math.comb(n_k + kind.order, n_k) * (1 + kind.degree) for kind in kinds]
    usable = [i for i, size in enumerate(sizes) if _RUNS_PER_TERM * size <= n] or [0]
    errors = []
    for i in usable:
        error = np.zeros(batch.n)
        for fit, held in parts:
            part = Motion(batch.select(fit), motion.way[fit], motion.heading[fit], motion.places)
            model, runs = first_guess(part, kinds[i]), batch.select(held)
            p = np.asarray(model.rollout_batch(None, runs.k).p).reshape(runs.p.shape)
            error[held] = np.abs(p - runs.p).max(axis=(1, 2))
        errors.append(error)
    most = max(_UNLIKE * np.median(errors[0]), TOLERANCES.profile_floor)
    errors = [np.clip(error, TOLERANCES.profile_floor, most) for error in errors]
    best = errors[int(np.argmin([error.mean() for error in errors]))]
    little = _LITTLE * best.mean()
    for place in sorted(range(len(usable)), key=lambda place: sizes[usable[place]]):
        more = errors[place] - best
        if more.mean() <= max(little, more.std() / np.sqrt(len(more))):
            break
    return kinds[usable[place]]


def first_guess(motion: Motion, kind: Kind) -> TwistModel:
    """The twist by linear least squares, turning from headings; runs unlike others count less."""
    time, domain = motion.batch.time, motion.batch.domain
    terms = monomials(domain, kind.order, motion.batch.k)
    shape = basis(time, kind.degree + 1).T
    fine, records = np.linspace(0, 1, _fine(time) + 1), np.linspace(0, 1, time.n_record + 1)
    heading = np.stack([np.interp(fine, records, run) for run in motion.heading])
    to_turn = integrated(time, shape)[..., :: _within(time)][:, 1:]
    moving = integrated(time, shape * np.exp(1j * heading)[:, None])
    to_move = moving[..., :: _within(time)][..., 1:]
    turned = motion.heading[:, 1:] - motion.heading[:, :1]
    turning = _robust(np.einsum("jt,na->ntja", to_turn, terms), turned)
    speed = _robust(np.einsum("njt,na->ntja", to_move, terms), motion.way[:, 1:])
    gain = np.stack([speed.real, speed.imag, turning.real], axis=-1)
    goal = np.linalg.lstsq(terms, motion.batch.q, rcond=None)[0]
    return TwistModel(motion.batch.subject, kind.order, gain, motion.places, goal)


def _robust(columns: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Coefficients (j, a) of columns (n, t, j, a) for targets (n, t), robust to odd runs."""
    n, t, *shape = columns.shape
    flat = columns.reshape(n, t, -1)
    turned = flat.conj().swapaxes(1, 2)
    squares, products = turned @ flat, turned @ target[..., None]  # per run, once
    weight = np.ones((n, 1, 1))
    for _ in range(_ROUNDS):
        whole, right = (weight * squares).sum(axis=0), (weight * products).sum(axis=0)[:, 0]
        found = np.linalg.lstsq(whole, right, rcond=None)[0]
        error = np.abs(target - flat @ found).max(axis=1)
        weight = np.minimum(1.0, 2 * np.median(error) / np.maximum(error, 1e-12))[:, None, None]
    return found.reshape(shape)


def fitted(motion: Motion, kind: Kind) -> TwistModel:
    """The twist by least squares of all places at the knots, large errors counted linearly."""
    from scipy.optimize import least_squares

    start = first_guess(motion, kind)
    batch = motion.batch
    terms = monomials(batch.domain, kind.order, batch.k)
    knots = slice(batch.time.stride, None, batch.time.stride)
    truth = by_point(np.asarray(batch.p, np.float64), len(batch.points))[:, knots]

    def residual(numbers):
        p = driven(batch.time, terms, numbers.reshape(start.gain.shape), motion.places)
        return (p[:, knots] - truth).reshape(-1)

    usual = float(np.median(np.abs(residual(start.gain.reshape(-1)))))
    found = least_squares(
        residual, start.gain.reshape(-1), loss="soft_l1", f_scale=max(2 * usual, 1e-6), max_nfev=10
    )
    gain = found.x.reshape(start.gain.shape)
    return TwistModel(batch.subject, kind.order, gain, motion.places, start.goal)
