"""A whole episode: every manoeuvre that a robot committed to is proved, and each began where the
one before it may have been left. [T38]
"""

import collections
import itertools
import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

from .claim import TESTED, at, checked_claim, told
from .entries import canonical, hash_of
from .exact import array, dot, fields, integers, need, number, rejecting, whole
from .plans import Context
from .question import about_open_bins, about_the_model
from .rests_on import SAME, checked_premises, doubt_of, lines_of, seconds
from .turns import MOST, OFF, cosine_and_sine

KIND = "parc_jax.episode/"  # of any version
EPISODE = f"{KIND}3"
# What is hashed as one; the first three are what work is allowed for
PARTS = ("network", "tube", "manoeuvres", "claim", "copies", "doubt", "premises")

# manoeuvres: how many. begin, end: [s] of the first pose and of the last knot. rests: how often the
# next one began when the one before had come to its end. moving: manoeuvres with obstacles that are
# told of for some of its intervals each. moves: [m] that a coordinate of a point of a manoeuvre
# that came to its end changes in its last interval at most: as predicted, and in the tube.
# premises: what it rests on. bins, without_model, without_claim, claim, arithmetic: as of an
# answer.
Report = collections.namedtuple(
    "Report",
    "manoeuvres begin end rests moving moves premises bins without_model without_claim claim "
    "arithmetic hash",
)

# One manoeuvre, as the next one asks for it: k, from when it is, from where: place, heading or
# None; its body; and what is predicted: outputs over a scale, errors by interval and point, and at
# the end.
Begun = collections.namedtuple("Begun", "k begin place heading parts y scale errors final")


def is_episode(file: object) -> bool:
    """Does a parsed file say that it is an episode, of whatever version?"""
    return type(file) is dict and str(file.get("format")).startswith(KIND)


@rejecting()
def check_episode(episode: dict, allowance_of: Callable) -> Report:
    """Checks all that an episode (as `load` returns it) claims; returns a Report or raises
    Rejected. allowance_of: the work that parts, as texts, may ask for.
    """
    version = episode.get("format")
    known = version == EPISODE
    need(known, f"it has the format {version!a:.60}, not {EPISODE}: drive again, and save that")
    fields(episode, ("format", "hash", *PARTS), ("meta",))
    texts = {part: canonical(episode[part]) for part in PARTS[:3]}
    hashes = {part: hash_of(episode[part]) for part in ("network", "tube")}
    hashes["episode"] = hash_of({part: episode[part] for part in PARTS})
    need(episode["hash"] == hashes, "a hash does not match its content")
    claim = episode["claim"]
    need(
        type(claim) is not dict or claim.get("kind") != TESTED,
        "its claim is about draws from one set in one scene, and its plans were chosen",
    )
    premises = checked_premises(episode)
    chain = Chain(episode, allowance_of(texts.values()))
    entries = episode["manoeuvres"]
    begins = [number(entry["begin"]) for entry in entries]
    came, moves = [], []
    for i, entry in enumerate(entries):
        with rejecting(f"manoeuvres[{i}]: "):
            need(chain.add(entry), "it began outside of the tube")
            end = chain.last.begin + chain.context.T * chain.context.dt
            if entry is entries[-1] or begins[i + 1] >= end:
                came.append(i)
                moves.append(chain.moves_at_end())
    context, turns = chain.context, at(claim, "subject", "rotation") is not None
    stated = "rotation" in (at(claim, "subject") or {})
    need(turns or not stated or chain.last.heading is None, "its claim says that nothing turns")
    moving = sum(any("steps" in x for x in entry["problem"]["obstacles"]) for entry in entries)
    return Report(
        manoeuvres=len(entries),
        begin=begins[0],
        end=end,
        rests=len(came) - 1,
        moving=moving,
        moves=tuple(map(max, zip(*moves, strict=True))),
        premises=premises,
        bins=context.n_bins,
        without_model=context.bins_without_model(),
        without_claim=context.bins_without_claim(),
        claim=episode["claim"],
        arithmetic=checked_claim(
            episode["claim"], hashes, context.n_bins, (context.lo, context.hi), context.dt
        ),
        hash=hashes,
    )


class Chain:
    """Manoeuvres of an episode as they come, with what it says of all of them: network, tube,
    copies and doubt. work: that they may ask for. last: the one that is kept, as it is Begun.
    """

    def __init__(self, episode: dict, work: float = math.inf):
        self.episode, self.work = episode, work
        self.context: Any = None  # of the last one
        self.last: Any = None

    def add(self, entry: dict) -> bool:
        """Checks one more; returns whether it began where the one before it may have been left.
        Raises Rejected where it is not safe from its pose, began too early, or has another body.
        """
        fields(entry, ("begin", "pose", "problem", "sample"))
        if self.context is None:
            episode = self.episode
            self.context = Context(entry["problem"], episode["network"], episode["tube"])
            self.context.work_left = self.work
            self.copies = whole(episode["copies"], 1, self.context.n_points)
            self.doubt = doubt_of(episode, self.context.n_p)
        else:
            self.context = self.context.about(entry["problem"])
        before, self.last = self.last, self.check_manoeuvre(entry)
        if before is None:
            return True
        need(before.parts == self.last.parts, "its body is another than before")
        frames = (before.heading is None) == (self.last.heading is None)
        need(frames, "it is told in another frame than the one before")
        return self.follows(before, self.last)

    def check_manoeuvre(self, entry: dict) -> Begun:
        """One of them, which is safe over all of its time from its pose, as it is Begun."""
        context = self.context
        pose = [number(x) for x in array(entry["pose"])]
        n_p = context.n_p
        turned = len(pose) == n_p + 1
        need(turned or len(pose) == n_p, f"a pose has {n_p} numbers, in the plane maybe a heading")
        need(not turned or n_p == 2, "a heading is of the plane")
        need(not turned or abs(pose[n_p]) <= MOST, f"a heading is beyond {MOST} rad")
        held = not turned or self.doubt[n_p] == 0 or self.copies % 3 == 0
        need(held, "headings are off, and a point has no three copies")
        fits = not turned or all(part.vertices is None for part in context.parts)
        need(fits, "a polygon does not turn with the robot")
        for part in context.parts:
            own = {i // self.copies for i in part.points}
            every = {i * self.copies + c for i in own for c in range(self.copies)}
            need(every == set(part.points), "a part of the body leaves out copies of a point")
        p0, k = context.check_sample(entry["sample"])
        # with a heading all is told in the frame of the robot, which starts at its origin
        start = [Fraction(0)] * n_p if turned else pose
        need(p0 == start, "the plan does not start at the pose")
        errors, final = context.errors(context.bins_meeting(k, k, closed=True), max)
        whole_k, k_scale = integers(k)
        _, (y,), scale = context.evaluate([whole_k], k_scale)
        heading = pose[n_p] if turned else None
        parts = context.parts
        return Begun(k, number(entry["begin"]), pose[:n_p], heading, parts, y, scale, errors, final)

    def follows(self, one: Begun, other: Begun) -> bool:
        """May every reference point of the robot be where the other one has it at its start, when
        the one is left then? Both places are boxes, or what the tube has in place of boxes, and
        have to meet along the axes of the one.
        """
        context, n_p = self.context, self.context.n_p
        passed = other.begin - one.begin
        need(passed > 0, "it began before the one before it")
        need(2 * passed >= context.dt, "it began within half a time step of the one before it")
        knot = min(passed / context.dt, Fraction(context.T))
        step = int(knot)
        t = min(step, context.T - 1)
        # a knot belongs to both its intervals
        before = t - (t > 0 and passed - t * context.dt <= SAME)
        after = min(t + ((t + 1) * context.dt - passed <= SAME), context.T - 1)
        moved, off = displacement(one, other, self.doubt)
        for axis, sign in itertools.product(range(n_p), (1, -1)):
            w = [Fraction(sign * (a == axis)) for a in range(n_p)]
            back = [-x for x in seen_by(one, other, w)]
            for i in range(context.n_points // self.copies):
                way = sign * moved[axis]
                if i > 0:  # the first point is at the pose
                    way -= self.reach(other, Fraction(0), 0, i, back) + self.lost(other, i)
                for s in {before, t, after}:
                    if not way <= self.reach(one, knot, s, i, w) + off:
                        return False
        return True

    def reach(self, one: Begun, knot: Fraction, t: int, i: int, w: list) -> Fraction:
        """The most along w, in its own frame, that point i of the robot may be from the start of a
        manoeuvre after so many intervals, straight between knots, with the errors of interval t.
        """
        found = []
        for n in range(i * self.copies, (i + 1) * self.copies):
            errors = one.errors[t][n]
            self.context.spend(errors.cost)
            begin, end = (dot(w, self.place(one, s, n)) for s in (int(knot), math.ceil(knot)))
            found.append(begin + knot % 1 * (end - begin) + errors.support(w))
        return max(found)

    def place(self, one: Begun, s: int, i: int) -> list:
        """Where point i is predicted at knot s, from the start of a manoeuvre."""
        places = self.context.offset(s, i)
        return [Fraction(x, one.scale) for x in one.y[places]] or [Fraction(0)] * self.context.n_p

    def lost(self, other: Begun, i: int) -> Fraction:
        """How much more along any direction `reach` may be at the start of another manoeuvre, since
        that is known to a few roundings of cosine and sine alone.
        """
        if other.heading is None:
            return Fraction(0)
        n_p = self.context.n_p
        axes = [[int(a == axis) for a in range(n_p)] for axis in range(n_p)]
        axes += [[-x for x in w] for w in axes]
        return 4 * OFF * sum(abs(self.reach(other, Fraction(0), 0, i, w)) for w in axes)

    def moves_at_end(self):
        """[m] that a coordinate of a point changes in the last interval of the last manoeuvre at
        most: as predicted, and in the tube. Rejects one in whose tube nobody could stand: who does
        is off by what the errors of the interval allow at its beginning, the other way by those and
        the errors of the end at its end.
        """
        one, context, T = self.last, self.context, self.context.T
        found = []
        for i, axis in itertools.product(range(context.n_points), range(context.n_p)):
            way = self.place(one, T, i)[axis] - self.place(one, T - 1, i)[axis]
            w = [(1 if way > 0 else -1) * int(a == axis) for a in range(context.n_p)]
            errors, back = one.errors[T - 1][i], [-x for x in w]
            at_end = errors.support(back)
            if one.final.is_box:
                before, after = i * context.n_p, context.n_end - (i + 1) * context.n_p
                at_end = min(at_end, one.final.support([0] * before + back + [0] * after))
            room = errors.support(w) + at_end
            need(abs(way) <= room, "it does not come to rest: its last interval leaves no room")
            # who goes on is ahead at the end and was behind before
            found.append((abs(way), abs(way) + errors.support(w) + errors.support(back)))
        return tuple(map(max, zip(*found, strict=True)))


def displacement(one: Begun, other: Begun, doubt: list) -> tuple:
    """The way from one place to the other as the one sees it, and how far each axis may be off."""
    way = [b - a for a, b in zip(one.place, other.place, strict=True)]
    *start, heading, drift = doubt
    size = sum(map(abs, way))
    off = 2 * sum(start) + drift + heading * size
    if one.heading is None:
        return way, off
    return turned_back(one.heading, way), off + OFF * size


def seen_by(one: Begun, other: Begun, w: list) -> list:
    """A direction in the frame of the one in that of the other: each coordinate to 4 OFF."""
    if one.heading is None:
        return w
    return turned_back(other.heading, turned_back(-one.heading, w))


def turned_back(heading: Fraction, v: list) -> list:
    """v in the frame of this heading; each coordinate is off by at most OFF times its size."""
    cosine, sine = cosine_and_sine(heading)
    return [cosine * v[0] + sine * v[1], cosine * v[1] - sine * v[0]]


def metres(x: Fraction) -> str:
    """A length, rounded up to a tenth of a millimetre."""
    tenths = math.ceil(10**4 * x)
    return f"{tenths // 10**4}.{tenths % 10**4:04d} m"


def summary_of_episode(report: Report) -> Iterator[str]:
    """What was proved and what it rests on, as lines."""
    yield "ACCEPTED. Proved in exact arithmetic, for every trajectory inside the tube:"
    many = "manoeuvre" if report.manoeuvres == 1 else "manoeuvres"
    yield f"  {report.manoeuvres} {many}, each from its stated pose to its last knot: nothing"
    yield "    is touched that was there for it; each began, with all of its reference points,"
    yield "    where the one before may have been left"
    span = f"{seconds(report.begin)} to {seconds(report.end)}"
    predicted, most = map(metres, report.moves)
    yield f"  so from {span}, if the last one is driven to its end, nothing is"
    yield "    touched that was there for the manoeuvre under way. In the last interval of those"
    yield f"    that came to their end, the last one and {report.rests} before, no point moves"
    yield f"    along an axis by more than {most}, as predicted by no more than {predicted}"
    if report.moving:
        yield f"NOT PROVED: in {report.moving} manoeuvres obstacles are told of by intervals, as"
        yield "  those that move are, at most until its last knot: nothing is said of them before"
        yield "  and after. They may run into a robot that rests"
    yield about_the_model(report)
    yield from about_open_bins(report)
    yield "What this is about, and what it rests on:"
    yield from lines_of(report.premises)
    yield from told(report.claim, report.arithmetic, report.hash)
