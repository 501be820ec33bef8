"""Do a header's margins pay for all rounding? What the theorem about its code asks of the tables,
asked number by number in exact rationals; bounds on the way are rounded up. [T10, T11]

Names and formulas are those of the proof (Dot.v, Network.v, Sound.v of tests/onboard/rocq).
"""

from fractions import Fraction
from functools import cache

import numpy as np

from parc_jax.claim.error_set import NO_CLAIM, ErrorBox
from parc_jax.errors import InputError
from parc_jax.lp.exact import round_up
from parc_jax.model import TrajectoryModel
from parc_jax.network.relu import ReLUNetwork
from parc_jax.onboard.tables import Tables

U = Fraction(1, 2**53)  # unit roundoff of a double
ETA = Fraction(1, 2**1022)  # its least normal number
LARGEST = Fraction(2**1023)  # a result of at most this size does not overflow

_exact = np.vectorize(Fraction, otypes=[object])
_up = np.vectorize(lambda x: Fraction(round_up(x)), otypes=[object])


def require_paid(known: Tables, model: TrajectoryModel, slack: float) -> None:
    """Half of the slack for each unit of |w|_1 pays for what the header's own code rounds; the
    other half is for the tables. Raises InputError where it does not.

    Of fitted tubes nothing is asked here: their supports are no part of the theorem.
    """
    if not isinstance(known.errors, ErrorBox):
        return
    unpaid = _unpaid(known, model, Fraction(slack) / 2)
    if unpaid:
        raise InputError(
            f"export: expected margins that pay for all rounding; those of {unpaid} do not. Give "
            "rows of the goal and of the start in metres, none of them nearly zero."
        )


def _unpaid(known: Tables, model: TrajectoryModel, room: Fraction) -> str | None:
    """The first part whose margins do not pay; None where all do."""
    half = np.minimum(known.errors.half, NO_CLAIM)
    numbers = (*known.edges, known.far, known.start_A, known.start_b, known.goal_A, known.goal_b)
    if not all(np.isfinite(x).all() for x in (*numbers, half, known.runs.w, known.runs.support)):
        return "numbers that are not finite"
    start = max(map(Fraction, known.far))
    ends = [Fraction(max(abs(e[0]), abs(e[-1]))) for e in known.edges]
    bounded = _network_bounded(model.net, np.array(ends, object))
    if bounded is None:
        return "a network whose outputs may overflow"
    beta, most = bounded
    moved = U * (most + start) + ETA  # what p0 + out loses
    off, size = beta + moved, most + start + moved
    if size > LARGEST:
        return "starts so far out that sums may overflow"
    of_rows = _norms(known.start_A)
    if not _rows_paid(of_rows, model.n_p, Fraction(0), start, room):
        return "a row of the start"
    of_rows = _norms(known.goal_A)
    if not _rows_paid(of_rows, model.n_c + model.n_q, off, size, room):
        return "a row of the goal"
    return _runs_unpaid(known, model.n_p, (off, size), Fraction(float(half.max())), room)


def _network_bounded(net: ReLUNetwork, size: np.ndarray) -> tuple[Fraction, Fraction] | None:
    """beta >= |fl N(k) - N(k)| and most >= |fl N(k)| for all |k| <= size (n_k,); None: overflow."""
    off = 0 * size
    for W, b in zip(net.weights, net.biases, strict=True):
        n = W.shape[1]
        weight = np.abs(_exact(W))
        absolute = weight @ size + np.abs(_exact(b))
        if (absolute > LARGEST / 4).any():
            return None
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


def _runs_unpaid(known: Tables, n_p: int, path, widest: Fraction, room: Fraction) -> str | None:
    off, size = path
    deep, many = n_p + 1, 2 * n_p
    g = _grown(deep) - 1
    least = many * ETA * _grown(deep)
    for norm, support in zip(_norms(known.runs.w), map(Fraction, known.runs.support), strict=True):
        reach = _reach_of(deep, many, norm * size)
        if max(reach, abs(support) + _reach_of(deep, many, norm * widest)) > LARGEST:
            return "a direction along which sums may overflow"
        rest = (1 + 2 * U) * (reach + ETA) + abs(support) + least
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
    """What n roundings, at most so many one after another, may lose of terms of a size."""
    return (_grown(depth) - 1) * size + n * ETA * _grown(depth)


def _reach_of(depth: int, n: int, size):
    return _lost_by(depth, n, size) + size
