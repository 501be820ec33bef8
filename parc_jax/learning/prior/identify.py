"""Which twist runs show: the simplest model that others of them do not contradict."""

import math
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.network.predict import by_point
from parc_jax.learning.prior.correct import folds
from parc_jax.learning.prior.twist import (
    TwistModel,
    at_fine_times,
    at_records,
    basis,
    driven,
    integrated,
    monomials,
)
from parc_jax.learning.runs.batch import RolloutBatch

ORDERS, DEGREES = (1, 2, 3), (0, 1, 2, 3)  # of polynomials in k, and in time
_LEAST = 8  # runs
_RUNS_PER_TERM = 6  # at least so many distinct k for each number of a rate
_UNLIKE = 5.0  # [median error] larger errors of a run count as so large
_LITTLE = 0.02  # [share of an error] that no number more is worth
_RIGID = 0.1  # [share of the body] that points may move within it and still be one body
_ROUNDS = 5  # in which runs that are unlike the others lose weight


class Seen(NamedTuple):
    """Finite runs as bodies that move. batch: them. way (n, n_record + 1) complex [m] of the first
    point, heading (n, n_record + 1) [rad], places (n_points, 2) [m] of the points at the start.
    """

    batch: RolloutBatch
    way: np.ndarray
    heading: np.ndarray
    places: np.ndarray


class Kind(NamedTuple):
    """A family of twists: orders of the polynomials in k and in time."""

    order: int
    degree: int


def moving_body(runs: RolloutBatch) -> Seen:
    """What the finite ones of these runs show of the body. Raises InputError for runs that are not
    those of one rigid body in the plane, each told in the frame of its own start, or too few.
    """
    if runs.n_p != 2:
        raise InputError(
            f"prior twist: expected positions in the plane; got {runs.n_p} coordinates. Give a "
            "simulator as the prior."
        )
    batch = runs.finite
    if batch.n < _LEAST:
        raise InputError(
            f"prior twist: expected at least {_LEAST} finite training runs; got {batch.n} of "
            f"{runs.n}."
        )
    points = by_point(np.asarray(batch.p, np.float64), len(batch.points)) @ np.array([1.0, 1j])
    if len(batch.points) == 1:
        return Seen(batch, points[..., 0], _along(points[..., 0]), np.zeros((1, 2)))
    arms = points - points[..., :1]
    at_start = np.median(arms[:, 0].real, axis=0) + 1j * np.median(arms[:, 0].imag, axis=0)
    off = np.abs(arms[:, 0] - at_start).max(axis=1)
    size = np.abs(arms[:, 0]).max()
    if np.median(off) > _RIGID * size:
        raise InputError(
            "prior twist: expected every run in the frame in which it begins; in half of the runs "
            f"the reference points start {np.median(off):.2g} m from where they usually do. Turn "
            "the runs."
        )
    heading = np.unwrap(np.angle(arms @ at_start.conj()), axis=1)
    bent = np.abs(arms - np.exp(1j * heading)[..., None] * at_start).max(axis=(1, 2))
    if np.median(bent) > _RIGID * size:
        raise InputError(
            "prior twist: expected reference points of one rigid body; they move against each "
            f"other by {np.median(bent):.2g} m in half of the runs. Give a simulator as the prior."
        )
    return Seen(batch, points[..., 0], heading, np.stack([at_start.real, at_start.imag], axis=1))


def _along(way: np.ndarray) -> np.ndarray:
    """Headings (n, n_record + 1) of one point that does not slide sideways, from its way (n,
    n_record + 1): forwards or backwards, whichever begins nearer to ahead.
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


def chosen_kind(seen: Seen) -> Kind:
    """The smallest kind that is as good as the best one, but for a standard error, where every
    fifth of the runs is predicted from the others.
    """
    parts = list(folds(seen.batch))
    n = min(len(np.unique(seen.batch.k[fit], axis=0)) for fit, _ in parts)
    kinds = [Kind(order, degree) for order in ORDERS for degree in DEGREES]
    n_k = seen.batch.n_k
    sizes = [math.comb(n_k + kind.order, n_k) * (1 + kind.degree) for kind in kinds]
    usable = [i for i, size in enumerate(sizes) if _RUNS_PER_TERM * size <= n] or [0]
    errors = []
    for i in usable:
        error = np.zeros(seen.batch.n)
        for fit, held in parts:
            part = Seen(seen.batch.select(fit), seen.way[fit], seen.heading[fit], seen.places)
            model = first_guess(part, kinds[i])
            error[held] = worst_error(model, seen.batch.select(held))
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


def worst_error(model, runs: RolloutBatch) -> np.ndarray:
    """(n,) [m] the largest error of a model with `rollout_batch`, of any coordinate at any time."""
    p = np.asarray(model.rollout_batch(None, runs.k).p).reshape(runs.p.shape)
    return np.abs(p - runs.p).max(axis=(1, 2))


def first_guess(seen: Seen, kind: Kind) -> TwistModel:
    """The twist by linear least squares, turning from headings; runs unlike others count less."""
    time, domain = seen.batch.time, seen.batch.domain
    terms = monomials(domain, kind.order, seen.batch.k)
    shape = basis(time, kind.degree + 1).T
    turned = np.exp(1j * at_fine_times(time, seen.heading))
    to_turn = at_records(time, integrated(time, shape))[:, 1:]
    to_move = at_records(time, integrated(time, shape * turned[:, None]))[..., 1:]
    turning = _robust(
        np.einsum("jt,na->ntja", to_turn, terms), seen.heading[:, 1:] - seen.heading[:, :1]
    )
    speed = _robust(np.einsum("njt,na->ntja", to_move, terms), seen.way[:, 1:])
    gain = np.stack([speed.real, speed.imag, turning.real], axis=-1)
    goal = np.linalg.lstsq(terms, seen.batch.q, rcond=None)[0]
    return TwistModel(seen.batch.subject, kind.order, gain, seen.places, goal)


def _robust(columns: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Coefficients (j, a) of columns (n, t, j, a) for what was seen (n, t)."""
    n, t, *shape = columns.shape
    flat = columns.reshape(n, t, -1)
    turned = flat.conj().swapaxes(1, 2)
    squares, products = turned @ flat, turned @ seen[..., None]  # of every run: rounds are cheap
    weight = np.ones((n, 1, 1))
    for _ in range(_ROUNDS):
        whole, right = (weight * squares).sum(axis=0), (weight * products).sum(axis=0)[:, 0]
        found = np.linalg.lstsq(whole, right, rcond=None)[0]
        error = np.abs(seen - flat @ found).max(axis=1)
        weight = np.minimum(1.0, 2 * np.median(error) / np.maximum(error, 1e-12))[:, None, None]
    return found.reshape(shape)


def fitted(seen: Seen, kind: Kind) -> TwistModel:
    """The twist by least squares of all places at the knots, large errors counted linearly."""
    from scipy.optimize import least_squares

    start = first_guess(seen, kind)
    batch = seen.batch
    terms = monomials(batch.domain, kind.order, batch.k)
    knots = slice(batch.time.stride, None, batch.time.stride)
    truth = by_point(np.asarray(batch.p, np.float64), len(batch.points))[:, knots]

    def residual(numbers):
        p = driven(batch.time, terms, numbers.reshape(start.gain.shape), seen.places)
        return (p[:, knots] - truth).reshape(-1)

    usual = float(np.median(np.abs(residual(start.gain.reshape(-1)))))
    found = least_squares(
        residual, start.gain.reshape(-1), loss="soft_l1", f_scale=max(2 * usual, 1e-6), max_nfev=10
    )
    gain = found.x.reshape(start.gain.shape)
    return TwistModel(batch.subject, kind.order, gain, seen.places, start.goal)
