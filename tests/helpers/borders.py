"""Points exactly on the borders of what the checker accepts, judged by `exact_truth`.

From the plan of a sample, a corridor or a polytope a ray is followed, in fractions, to the first
border: of a row of the polytope, or of a condition of the sample. The point there, and points a
little before and beyond it, are put to the checker and to the definition.
"""

import collections
import math
import operator
import random
from fractions import Fraction as F

import answer_files as build
import exact_truth
from rows_of_sets import set_rows

from parc_jax import checker

STEP = F(1, 2**40)  # a little, as a share of the ray
VARIANTS = (
    dict(bins=(2, 1)),
    dict(bins=(3, 2), body=build.TRIANGLE, n_q=0),
    dict(bins=(2, 2), body={"radius": "0"}, starts=False),
    dict(bins=(3,), n_k=1, T=5),
    dict(bins=(2, 1), body={"radius": "1/8"}, T=4, hidden=(3, 3)),
)


def scene(seed):
    """A random answer; its bins have very different widths."""
    variant = dict(T=4, hidden=(3, 2)) | VARIANTS[seed % len(VARIANTS)]
    answer = build.scene(seed, **variant)
    rng = random.Random(seed)
    for part in ("interval", "final"):
        for number in range(len(answer["tube"][part])):
            share = F(1, 2 ** rng.randint(0, 3))
            answer["tube"][part][number] = scaled(answer["tube"][part][number], share)
    return build.rehash(answer)


def scaled(x, share):
    return (
        [scaled(v, share) for v in x] if isinstance(x, list) else build.text(build.value(x) * share)
    )


class Borders:
    """Border points of one answer. tally: how many of each kind and verdict; "wrong: ..." for what
    must never be.
    """

    def __init__(self, answer, seed):
        self.answer = answer
        self.parts = [answer[part] for part in checker.PARTS]
        self.context = checker.Context(*self.parts)
        self.truth = exact_truth.Truth(answer)
        self.rng = random.Random(seed)
        self.n_p = self.context.n_p
        self.tally = collections.Counter()

    def accepts(self, sep, x):
        """Whether the checker accepts a point x = (p0, k) as a sample with these directions."""
        p0, k = build.text(x[: self.n_p]), build.text(x[self.n_p :])
        try:
            self.context.check_sample({"p0": p0, "k": k, "sep": sep})
        except checker.Rejected:
            return False
        return True

    def judge(self, kind, where, sep, x, member=None):
        """Puts one point to everybody. member: of the polytope, None for other kinds."""
        p0, k = x[: self.n_p], x[self.n_p :]
        accepted = self.accepts(sep, x)
        keeps = build.keeps(*self.parts, sep, p0, k)
        if accepted and not keeps:
            self.tally["wrong: accepted, but the conditions in fractions fail"] += 1
        if keeps and not accepted and not self.context.parts[0].radius:
            self.tally["wrong: refused, but the conditions in fractions hold"] += 1
        if member and not accepted:
            self.tally["wrong: in the polytope, but no sample"] += 1
        if (accepted or member) and not self.truth.safe(p0, k):
            self.tally["wrong: accepted, but not safe"] += 1
        self.tally[kind, where, "in" if accepted or member else "out"] += 1

    def polytope(self, piece, count):
        """Rays from the inner point of a polytope to its rows."""
        rows = set_rows(self.context, piece)
        centre = build.value(piece["p0"]) + build.value(piece["k"])
        for i in range(count):
            way = [build.dyadic(self.rng, 1, 6) for _ in centre]
            if i % 3 == 0:  # along one axis: straight at a face of the bin or the domain
                axis = self.rng.randrange(self.n_p, len(centre))
                way = [v if j == axis else F(0) for j, v in enumerate(way)]
            step = first_border(rows, centre, way)
            if step is None:
                continue
            for where, share in places(i):
                x = [c + share * step * v for c, v in zip(centre, way, strict=True)]
                inside = contains(rows, x)
                self.judge("polytope", where, piece["sep"], x, inside)
            self.corner(
                piece["sep"], rows, [c + step * v for c, v in zip(centre, way, strict=True)]
            )

    def corner(self, sep, rows, x):
        """From a point of the border along the border, by p0 alone, to the next one."""
        way = [build.dyadic(self.rng, 1, 6) for _ in range(self.n_p)]
        way += [F(0)] * (len(x) - self.n_p)
        step = first_border(rows, x, way)
        if step:
            for share in (F(1), 1 - STEP):
                moved = [c + share * step * v for c, v in zip(x, way, strict=True)]
                inside = contains(rows, moved)
                self.judge("polytope", "on", sep, moved, inside)

    def plan(self, kind, entry, count):
        """Plans with other k, also on edges of bins and ends of K, moved in p0 until a condition is
        met with equality.
        """
        centre, k0 = build.value(entry["p0"]), build.value(entry["k"])
        for i in range(count):
            k = [min(max(v + build.dyadic(self.rng, F(1, 4)), F(-1)), F(1)) for v in k0]
            if i % 2 == 0:
                axis = self.rng.randrange(len(k))
                edges = build.value(self.parts[2]["edges"][axis])
                k[axis] = min(edges, key=lambda edge, at=k0[axis]: abs(edge - at))
            x = centre + k
            step = self.tight(entry["sep"], x)
            if step is None:
                continue
            for where, share in places(i):
                p0 = [c + share * s for c, s in zip(centre, step, strict=True)]
                self.judge(kind, where, entry["sep"], p0 + k)

    def tight(self, sep, x):
        """A move of p0 along some condition's direction that makes it an equation."""
        context = self.context
        bins = context.bins_meeting(x[self.n_p :], x[self.n_p :], closed=True)
        whole, scale = checker.integers(x[self.n_p :])
        _, (y,), y_scale = context.evaluate([whole], scale)
        conditions = list(context.conditions(sep, bins))
        asked = self.rng.choice([c for c in conditions if any(c.w)] or [None])
        if asked is None:
            return None
        along = F(checker.exact.dot(asked.v, y[asked.outputs]), y_scale)
        value = build.dot(asked.w, x[: self.n_p]) + along + asked.c
        return [-value * F(w, build.dot(asked.w, asked.w)) for w in asked.w]


def places(i):
    """Where on the ray: at the border, for some also a little before and beyond it."""
    yield "on", F(1)
    if i % 4 == 0:
        yield "before", 1 - STEP
        yield "beyond", 1 + STEP


def first_border(rows, centre, way):
    """The step along a way at which the first row becomes an equation, None if none does."""
    steps = []
    for _, _, a, c in rows:
        speed = build.dot(a, way)
        if speed < 0:
            steps.append(-(build.dot(a, centre) + c) / speed)
    return min(steps, default=None)


def contains(rows, x):
    """Whether a point is in a polytope of rows."""
    scale = math.lcm(*(v.denominator for v in x))
    whole = [int(v * scale) for v in x]
    for _, strict, a, c in rows:
        value = sum(map(operator.mul, a, whole)) + c * scale
        if value < 0 or (strict and value == 0):
            return False
    return True


def look(seed, count):
    """The tally of about 10 * count points on borders of one random answer."""
    answer = scene(seed)
    borders = Borders(answer, seed)
    for piece in answer["sets"]:
        try:
            borders.context.check_set(piece)
        except checker.Rejected:
            continue  # its point lies on a border: it is no certificate
        borders.polytope(piece, count)
    for kind in ("samples", "corridors"):
        for entry in answer[kind]:
            borders.plan(kind, entry, count)
    return borders.tally
