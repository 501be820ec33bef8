"""Tables of a header against the checker's own conditions, in exact rationals: a plan that keeps to
them, with the room that the theorem about the code takes, meets all conditions of one of the
answer's corridors. So what a header calls safe is safe. [T11, T27]
"""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import combinations, product
from typing import NamedTuple

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.checker import Context
from parc_jax.checker.exact import combine
from parc_jax.checker.plans import support
from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import Basis
from parc_jax.drive.onboard.paid import places_bounded
from parc_jax.drive.onboard.tables import Tables
from parc_jax.learning.bound.error_set import ErrorBox, ErrorSet, at
from parc_jax.proof.certificate.write import corridor_part, part_hash, question_parts

SPARE = Fraction(1, 4)  # of the slack for each unit of |w|_1, for slanted faces that are rounded


def require_kept(table: Tables, answer: Answer, slack: float) -> dict[str, str]:
    """Raises InputError unless every plan that keeps to the tables, each threshold less by half of
    the slack for each unit of |w|_1, meets the checker's conditions of a corridor of the answer.
    Returns the SHA-256 of the parts of the answer that they are those of, by name.
    """
    question = question_parts(answer.problem, answer.model)
    corridors = [corridor_part(corridor, answer.problem) for corridor in answer.corridors]
    compared = _Compared(table, answer, Context(*question), Fraction(slack))
    wrong = next(compared.wrong([part["sep"] for part in corridors]), None)
    if wrong:
        raise InputError(
            f"export: expected tables that ask for as much as the answer's corridors; {wrong} ask "
            "for less. Was the answer put together by hand? Solve again, and export that answer."
        )
    names = ("problem", "network", "tube", "corridors")
    return {name: part_hash(part) for name, part in zip(names, [*question, corridors], strict=True)}


class _Compared(NamedTuple):
    table: Tables
    answer: Answer
    context: Context
    slack: Fraction

    def wrong(self, seps: list) -> Iterator[str]:
        """Names of what asks for less. seps: of the answer's corridors."""
        table, context, room = self.table, self.context, self.slack / 2
        bounded = places_bounded(table, self.answer.model)
        if bounded is None:
            yield "a network whose outputs may overflow"
            return
        size = bounded.start + bounded.most  # of every coordinate of a plan that is let pass
        edges = [[*map(Fraction, edge.tolist())] for edge in table.edges]
        ends = [(e[0], e[-1]) for e in edges]
        if edges != context.edges or ends != [*zip(context.lo, context.hi, strict=True)]:
            yield "the edges of the bins"
        starts = [(a, b + room * _size(a)) for a, b in _rows(table.start_A, table.start_b)]
        if not all(any(row == a and b <= most for row, b in starts) for a, most in context.start):
            yield "the rows of the start"
        reached: dict[int, list] = {}  # rows of the goal in each bin of which a plan is let pass
        for bin_, limits in enumerate(table.goal_b):
            rows = [(a, b + room * _size(a)) for a, b in _rows(table.goal_A, limits)]
            if all(b >= -size * _size(a) for a, b in rows):
                reached[bin_] = rows
        for bin_, rows in reached.items():
            final = context.errors([bin_], max)[1]
            for i, (a, b) in enumerate(context.goal):
                least = b - final.support(a, i)
                if not any(row == a and limit <= least for row, limit in rows):
                    yield "the rows of the goal"
        widest = Fraction(0)
        for bin_ in reached:
            for t, i in product(range(context.T), range(context.n_points)):
                of_table = at(table.errors, (bin_, t, i))
                width = held(of_table, context.interval[bin_][t][i], SPARE * self.slack)
                if width is None:
                    yield "errors"
                    return
                widest = max(widest, width)
        for place, corridor in enumerate(table.order):
            yield from self._corridor(place, seps[corridor], size + widest)

    def _corridor(self, place: int, sep: list, size: Fraction) -> Iterator[str]:
        """size: of every coordinate of a place with its error."""
        table, context = self.table, self.context
        room = self.slack / 2 + (0 if isinstance(table.errors, ErrorBox) else SPARE * self.slack)
        first, end = table.runs.first_run[place : place + 2]
        own: dict = {}  # the run of each pair and interval
        for run in range(first, end):
            for t in range(table.runs.first[run], table.runs.end[run]):
                own[table.runs.pair[run], t] = run
        apart = self.answer.scene.apart
        pairs = range(len(context.obstacles) * len(context.parts)) if apart is None else apart.kept
        for pair, number in enumerate(pairs):
            o, of_body = divmod(int(number), len(context.parts))
            part, (rows, t, last) = context.parts[of_body], context.obstacles[o]
            if not set(part.points) <= set(table.pair_points[pair].tolist()):
                yield "points of the body"
            for stop, multipliers in sep[o][of_body]:
                w, h = combine(rows, multipliers, context.n_p)
                for run in {own.get((pair, s)) for s in range(t, stop)}:
                    if run is None:
                        yield "the intervals of a corridor"
                        continue
                    near = [*map(Fraction, table.runs.w[run].tolist())]
                    off = sum((abs(x - y) for x, y in zip(w, near, strict=True)), Fraction(0))
                    beyond = Fraction(float(table.runs.support[run])) - room * _size(near)
                    if beyond - off * size < h + support(part, w):
                        yield "the directions of a corridor"
                t = stop
            if t != last + 1:
                yield "the intervals of a corridor"


def held(of_table: ErrorSet, exact, spare: Fraction) -> Fraction | None:
    """A bound on the coordinates of all errors of an exact set, where the table's set holds them:
    each of its bases does, up to `spare` along every axis. None where it does not.
    """
    if isinstance(of_table, ErrorBox):
        widths, half = exact.fractions(), [*map(Fraction, of_table.half.tolist())]
        return max(half) if all(e <= s for e, s in zip(widths, half, strict=True)) else None
    rows = [
        ([Fraction(x, exact.scale) for x in a], Fraction(b, exact.scale)) for a, b in exact.rows
    ]
    faces = [(u, -low, high) for (u, high), (_, low) in zip(rows[::2], rows[1::2], strict=True)]
    if any([-x for x in u] != v for (u, _), (v, _) in zip(rows[::2], rows[1::2], strict=True)):
        return None
    n = exact.n
    bases = zip(of_table.dual, of_table.centre, of_table.half, strict=True)
    for chosen, (dual, centre, half) in zip(combinations(faces, n), bases, strict=True):
        if (dual == np.eye(n)).all():  # a basis without claim is one of the axes too
            chosen = tuple(faces[:n])
        middle, reach = ([*map(Fraction, x.tolist())] for x in (centre, half))
        of_each = zip(chosen, middle, reach, strict=True)
        inside = all(c - s <= low and high <= c + s for (_, low, high), c, s in of_each)
        if not inside or _turned_by(chosen, dual) > spare:
            return None
    return max(max(abs(low), abs(high)) for _, low, high in faces[:n])


def _turned_by(chosen: Sequence, dual: np.ndarray) -> Fraction:
    """How far along an axis an error between these faces is at most from where dual says that it
    is: e = sum_j (u_j . e) v_j, with the v_j that dual has rounded.
    """
    n = len(chosen)
    basis = Basis(n)
    for u, _, _ in chosen:
        basis.add(u)
    if not basis.full:
        return Fraction(10) ** 400
    most = Fraction(0)
    for axis in range(n):
        unit = [Fraction(int(a == axis)) for a in range(n)]
        shares = basis.coordinates(unit) or []  # of the faces' normals in this axis
        turned = zip(shares, dual[:, axis].tolist(), chosen, strict=True)
        off = [abs(v - Fraction(x)) * max(abs(low), abs(high)) for v, x, (_, low, high) in turned]
        most = max(most, sum(off, Fraction(0)))
    return most


def _rows(A: np.ndarray, b: np.ndarray) -> list[tuple[list[Fraction], Fraction]]:
    return [([*map(Fraction, a)], Fraction(x)) for a, x in zip(A.tolist(), b.tolist(), strict=True)]


def _size(a: list[Fraction]) -> Fraction:
    return sum(map(abs, a), Fraction(0))
