"""`is_safe` of safe_set.h step by step, in floats as C has them or in exact rationals: the model of
parc_jax/drive/onboard/proved/theories/Header.v.
"""

from fractions import Fraction

from parc_jax.drive.onboard.tables import Tables
from parc_jax.learning.bound.error_set import at
from parc_jax.proof.absence.errors import as_template


def is_safe(known: Tables, model, p0, k, number=float, room=0) -> bool:
    """What a header of these tables says of p0 (n_p,), k (n_k,). number: float, in the order of the
    code and nothing fused; Fraction, exactly. room: thresholds are less by so much for each unit of
    |w|_1, and of rows.
    """
    p0, k = [[number(float(x)) for x in point] for point in (p0, k)]
    bin_ = _bin(known.edges, k)
    if bin_ is None or not all(abs(x) <= far for x, far in zip(p0, known.far, strict=True)):
        return False
    if not _rows_met(known.start_A, known.start_b, p0, number, room):
        return False
    n_c, n_q, n_points = model.n_c, model.n_q, model.n_points
    path = [number(0)] * model.n_p + _network(model.net, k, number)
    n_path = len(path) - n_q
    path = [x + p0[i % model.n_p] if i < n_path else x for i, x in enumerate(path)]
    end = path[n_path - n_c :]
    if not _rows_met(known.goal_A, known.goal_b[bin_], end, number, room):
        return False
    places = [path[i : i + model.n_p] for i in range(0, n_path, model.n_p)]
    knots = [places[i : i + n_points] for i in range(0, len(places), n_points)]
    first = known.runs.first_run
    return any(
        all(
            _apart(known, knots, bin_, run, t, number, room)
            for run in range(first[c], first[c + 1])
            for t in range(known.runs.first[run], known.runs.end[run])
        )
        for c in range(len(known.probes))
    )


def _bin(edges, k) -> int | None:
    bin_ = 0
    for edge, x in zip(edges, k, strict=True):
        if not edge[0] <= x <= edge[-1]:
            return None
        along = 0
        while along < len(edge) - 2 and x >= edge[along + 1]:
            along += 1
        if along and x == edge[along]:
            return None
        bin_ = bin_ * (len(edge) - 1) + along
    return bin_


def _rows_met(A, b, x, number, room) -> bool:
    rows = [[number(a) for a in row] for row in A.tolist()]
    return all(
        _dot(a, x, number) <= number(bound) + room * sum(map(abs, a))
        for a, bound in zip(rows, b.tolist(), strict=True)
    )


def _apart(known: Tables, knots, bin_, run, t, number, room) -> bool:
    w = [number(x) for x in known.runs.w[run].tolist()]
    support = number(float(known.runs.support[run])) - room * sum(map(abs, w))
    for point in known.pair_points[known.runs.pair[run]]:
        least = support + lost(known.errors, (bin_, t, point), w, number)
        if not all(_dot(w, knots[s][point], number) > least for s in (t, t + 1)):
            return False
    return True


def lost(errors, index, w, number):
    """How far the errors of a bin, an interval and a point reach against w: the least of all bases;
    a box is one, of the axes.
    """
    bases = at(as_template(errors, 1), index)
    return min(
        _reach(dual, centre, half, w, number)
        for dual, centre, half in zip(*(x.tolist() for x in vars(bases).values()), strict=True)
    )


def _reach(dual, centre, half, w, number):
    far = number(0)
    for row, c, s in zip(dual, centre, half, strict=True):
        mu = _dot([number(x) for x in row], w, number)
        far -= number(c) * mu
        far += number(s) * abs(mu)
    return far


def _network(net, k, number) -> list:
    value = k
    for W, b in zip(net.weights, net.biases, strict=True):
        rows, biases = W.tolist(), b.tolist()
        out = []
        for row, bias in zip(rows, biases, strict=True):
            to = number(bias)
            for weight, x in zip(row, value, strict=True):
                if x != 0:
                    to += number(weight) * x
            out.append(to)
        value = [x if x > 0 else number(0) for x in out]
    return out


def _dot(a, x, number):
    total = number(0)
    for left, right in zip(a, x, strict=True):
        total += left * right
    return total


def exactly(known: Tables, model, p0, k, room: Fraction) -> bool:
    """Does a plan keep to a corridor in real numbers, whose thresholds are less by the room?"""
    return is_safe(known, model, p0, k, Fraction, room)
