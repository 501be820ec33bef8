"""Premises of the theorem about a header's code, tested of its tables in exact rationals: they fit
together, and its margins pay for all rounding. Bounds on the way are rounded up. [T10, T11]

Names and formulas are those of the proof (Dot.v, Network.v, Tube.v, Sound.v in proved/theories).
"""

from fractions import Fraction
from functools import cache
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import round_up
from parc_jax.drive.onboard.tables import Tables
from parc_jax.learning.bound.error_set import ErrorTemplate
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.absence.errors import as_template

U = Fraction(1, 2**53)  # unit roundoff of a double
ETA = Fraction(1, 2**1022)  # its least normal number
LARGEST = Fraction(2**1023)  # a result of at most this size does not overflow

_exact = np.vectorize(Fraction, otypes=[object])
_up = np.vectorize(lambda x: Fraction(round_up(x)), otypes=[object])


def require_fitting(table: Tables, model: TrajectoryModel) -> None:
    """Raises InputError unless tables satisfy `fits_together` and no index leads out of one."""
    unfitting = _unfitting(table, model)
    if unfitting:
        raise InputError(
            f"export: expected tables that fit together; {unfitting} do not. Was the answer or "
            "its model put together by hand? Solve again, and export that answer."
        )


def _unfitting(table: Tables, model: TrajectoryModel) -> str | None:
    """The first table that does not fit to the others; None where all do."""
    n_p, n_c, n_k, T = model.n_p, model.n_c, model.n_k, model.time.n_steps
    runs, tube, n_runs = table.runs, as_template(table.errors, 1), len(table.runs.w)
    n_bins = [len(e) - 1 for e in table.edges]
    lead, n_goal = (int(np.prod(n_bins)), T, n_c // max(n_p, 1)), len(table.goal_A)
    widths = [n_k, *(len(b) for b in model.net.biases)]
    weights = [W.shape for W in model.net.weights]
    ends = (*runs.first_run[:1], *runs.first_run[-1:])
    fit = {
        "coordinates": 0 < n_p <= n_c and n_c % n_p == 0,
        "edges of the bins": len(n_bins) == n_k and all(n > 0 for n in n_bins),
        "layers of the network": weights == list(zip(widths[1:], widths[:-1], strict=True))
        and widths[-1] == (T + 1) * n_c - n_p + model.n_q,
        "errors": tube.half.shape[:3] == lead
        and tube.half.shape[4:] == (n_p,)
        and tube.centre.shape == tube.half.shape
        and tube.dual.shape == (*tube.half.shape, n_p),
        "rows of the start": table.start_A.shape == (len(table.start_b), n_p)
        and table.far.shape == (n_p,),
        "rows of the goal": table.goal_A.shape[1:] == (n_c + model.n_q,)
        and table.goal_b.shape == (lead[0], n_goal),
        "points of the body": _within(table.pair_points, lead[2]),
        "runs of the corridors": ends == (0, n_runs)
        and len(runs.first_run) == len(table.probes) + 1
        and bool((np.diff(runs.first_run) >= 0).all())
        and {len(column) for column in runs[1:]} == {n_runs}
        and runs.w.shape == (n_runs, n_p)
        and _within(runs.pair, len(table.pair_points))
        and _within(runs.first, T)
        and _within(runs.end, T + 1),
        "probes": _within(table.probes[..., 0], n_runs) and _within(table.probes[..., 1], T),
        "plans": table.plans.shape[1:] == (n_k,)
        and table.ends.shape == (len(table.plans), n_p)
        and table.near.shape == (2, n_p),
    }
    return next((what for what, fits in fit.items() if not fits), None)


def _within(indices: np.ndarray, n: int) -> bool:
    """Whether all of these are 0, 1, ... n - 1."""
    return bool(((indices >= 0) & (indices < n)).all())


def require_paid(table: Tables, model: TrajectoryModel, slack: float) -> None:
    """Raises InputError unless half of the slack for each unit of |w|_1 pays for all rounding of
    the header's code; the other half is for the tables.
    """
    unpaid = _unpaid(table, model, Fraction(slack) / 2)
    if unpaid:
        raise InputError(
            f"export: expected margins that pay for all rounding; those of {unpaid} do not. Give "
            "rows of the goal and of the start in metres, none of them nearly zero."
        )


def _unpaid(table: Tables, model: TrajectoryModel, room: Fraction) -> str | None:
    """The first part whose margins do not pay; None where all do."""
    tube = as_template(table.errors, 1)
    rows = (table.start_A, table.start_b, table.goal_A, table.goal_b)
    numbers = (*table.edges, table.far, *rows, table.runs.w, table.runs.support)
    if not all(np.isfinite(x).all() for x in (*numbers, tube.dual, tube.centre, tube.half)):
        return "numbers that are not finite"
    if (tube.half < 0).any():
        return "errors of less than none"
    bounded = places_bounded(table, model)
    if bounded is None:
        return "a network whose outputs may overflow"
    start, beta, most = bounded
    moved = U * (most + start) + ETA  # what p0 + out loses
    off, size = beta + moved, most + start + moved
    # compared before any sum: an overflow would make every later bound void
    if size > LARGEST:
        return "starts so far out that sums may overflow"
    of_rows = _norms(table.start_A)
    if not _rows_paid(of_rows, model.n_p, Fraction(0), start, room):
        return "a row of the start"
    of_rows = _norms(table.goal_A)
    if not _rows_paid(of_rows, model.n_c + model.n_q, off, size, room):
        return "a row of the goal"
    return _runs_unpaid(table, model.n_p, (off, size), _reaches(tube), room)


class Bounded(NamedTuple):
    """Of all plans that are let pass: |p0| <= start, and of the network's outputs, |N(k)| and what
    the code makes of it <= most, between them <= beta.
    """

    start: Fraction
    beta: Fraction
    most: Fraction


def places_bounded(table: Tables, model: TrajectoryModel) -> Bounded | None:
    """How far out plans are that are let pass; None where outputs may overflow."""
    ends = [Fraction(max(abs(e[0]), abs(e[-1]))) for e in table.edges]
    bounded = _network_bounded(model.net, np.array(ends, object))
    return None if bounded is None else Bounded(max(map(Fraction, table.far)), *bounded)


def _network_bounded(net: ReLUNetwork, size: np.ndarray) -> tuple[Fraction, Fraction] | None:
    """beta >= |fl N(k) - N(k)| and most >= |fl N(k)| for all |k| <= size (n_k,); None: overflow."""
    off = 0 * size
    for W, b in zip(net.weights, net.biases, strict=True):
        n = W.shape[1]
        weight = np.abs(_exact(W))
        absolute = weight @ size + np.abs(_exact(b))
        if (absolute > LARGEST / 4).any():
            return None
        # numerators of exact rationals grow with every layer: both bounds are rounded up
        off = _up(weight @ off + _lost_by(n + 1, 2 * n, absolute))
        size = _up(_reach_of(n + 1, 2 * n, absolute))
    return off.max(), size.max()


def _rows_paid(norms, n: int, off: Fraction, size: Fraction, room: Fraction) -> bool:
    """Rows of n terms, by their |a|_1, of numbers that are off and of some size."""
    return all(
        _reach_of(n + 1, 2 * n, norm * size) <= LARGEST
        and norm * off + _lost_by(n + 1, 2 * n, norm * size) <= room * norm
        for norm in norms
    )


class _Reaches(NamedTuple):
    """Of all bases of a tube: no entry of dual is above steep, the faces of none are together wider
    than wide; for each unit of |w|_1 no more than excess cancels.
    """

    steep: Fraction
    wide: Fraction
    excess: Fraction


def _reaches(tube: ErrorTemplate) -> _Reaches:
    n = tube.half.shape[-1]
    slanted = (tube.dual != 0).sum(axis=-1) > 1  # of a face along an axis no half cancels
    sizes = (tube.dual, tube.centre, tube.half, np.where(slanted, tube.half, 0.0))
    steep, centre, half, cancels = (Fraction(float(abs(x).max())) for x in sizes)
    return _Reaches(steep, n * (centre + half), n * steep * (2 * centre + cancels))


def _runs_unpaid(table: Tables, n_p: int, path, tube: _Reaches, room: Fraction) -> str | None:
    off, size = path
    deep, many = n_p + 1, 2 * n_p  # roundings of a sum along a direction, and of one face
    all_deep, all_many = 2 * n_p + 1, 4 * n_p  # of all faces of a basis
    g = _grown(deep + all_deep) - 1
    least = many * ETA * _grown(deep + all_deep) * tube.wide + all_many * ETA * _grown(all_deep)
    for norm, support in zip(_norms(table.runs.w), map(Fraction, table.runs.support), strict=True):
        reach, face = (_reach_of(deep, many, norm * x) for x in (size, tube.steep))
        faces = _reach_of(all_deep, all_many, tube.wide * face)
        if max(reach, face, abs(support) + faces) > LARGEST:
            return "a direction along which sums may overflow"
        rest = (1 + 2 * U) * (reach + ETA) + abs(support) + least + norm * tube.excess
        lost = norm * off + _lost_by(deep, many, norm * size) + least
        lost += g * (1 + 2 * g) * (rest + least) + U * rest + ETA
        if lost > room * norm:
            return "a direction of a corridor"
    return None


def _norms(A) -> list[Fraction]:
    return [sum((abs(Fraction(a)) for a in row), Fraction(0)) for row in A.tolist()]


@cache
def _grown(depth: int) -> Fraction:
    """At least (1 + u)^depth."""
    return Fraction(round_up((1 + U) ** depth))


def _lost_by(depth: int, n: int, size):
    """Bound on the loss of n roundings, `depth` of them in sequence, of terms of a size."""
    return (_grown(depth) - 1) * size + n * ETA * _grown(depth)


def _reach_of(depth: int, n: int, size):
    return _lost_by(depth, n, size) + size
