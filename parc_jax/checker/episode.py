"""A whole episode: every manoeuvre that a robot committed to is proved, and each began where the
one before it may have been left. [T38]
"""

import collections
import hashlib
import itertools
import math
from fractions import Fraction

from .claim import checked_claim, told
from .entries import canonical
from .exact import array, fields, integers, need, number, rejecting, whole
from .plans import Context
from .turns import OFF, cosine_and_sine

EPISODE = "parc_jax.episode/1"

# manoeuvres: how many. begin, end: [s] of the first pose and of the last rest. rests: how often the
# next one began when the one before had come to its end. moving: manoeuvres with obstacles that are
# told of for some of its intervals each. claim, arithmetic: as of an answer.
Report = collections.namedtuple("Report", "manoeuvres begin end rests moving claim arithmetic hash")

# One manoeuvre: k and its context, from when it is, from where: place, heading or None; and whether
# any of its obstacles is told of for some of its intervals.
Begun = collections.namedtuple("Begun", "context k begin place heading moving")


@rejecting()
def check_episode(episode, allowance_of):
    """Checks all that an episode (as `load` returns it) claims; returns a Report or raises
    Rejected. allowance_of: the work that parts, as texts, may ask for.
    """
    needed = ("format", "network", "tube", "claim", "hash", "copies", "doubt", "manoeuvres")
    fields(episode, needed, ("meta",))
    texts = {part: canonical(episode[part]) for part in ("network", "tube", "manoeuvres")}
    hashes = {
        part: hashlib.sha256(texts[part].encode()).hexdigest() for part in ("network", "tube")
    }
    need(episode["hash"] == hashes, "a hash does not match its content")
    entries = array(episode["manoeuvres"])
    need(len(entries) > 0, "an episode without a manoeuvre")
    chain = Chain(episode, allowance_of(texts.values()))
    begun = []
    for i, entry in enumerate(entries):
        with rejecting(f"manoeuvres[{i}]: "):
            one, follows_it = chain.add(entry)
            need(follows_it, "it began outside of the tube")
            begun.append(one)
    claim, last = episode["claim"], begun[-1]
    arithmetic = checked_claim(claim, hashes, last.context.n_bins)
    rests = sum(b.begin >= ended(a) for a, b in itertools.pairwise(begun))
    moving = sum(b.moving for b in begun)
    said = claim, arithmetic, hashes
    return Report(len(begun), begun[0].begin, ended(last), rests, moving, *said)


class Chain:
    """Manoeuvres of an episode as they come, with what it says of all of them: network, tube,
    copies and doubt. work: that they may ask for. last: the last of them, as it is Begun.
    """

    def __init__(self, episode, work=math.inf):
        self.episode, self.work = episode, work
        self.context: Context | None = None
        self.last: Begun | None = None

    def add(self, entry):
        """Checks one more; returns what is Begun, and whether it began where the one before it may
        have been left. Raises Rejected where it is not safe from its pose, or began no later than
        the one before.
        """
        fields(entry, ("begin", "pose", "problem", "sample"))
        episode = self.episode
        if self.context is None:
            self.context = Context(entry["problem"], episode["network"], episode["tube"])
            self.context.work_left = self.work
            self.copies = whole(episode["copies"], 1, self.context.n_points)
            self.doubt = [number(x) for x in array(episode["doubt"])]
        else:
            self.context = self.context.about(entry["problem"])
        before, self.last = self.last, check_manoeuvre(self.context, entry)
        inside = before is None or follows(before, self.last, self.copies, self.doubt)
        return self.last, inside


def check_manoeuvre(context, entry):
    """One of them, which is safe over all of its time from its pose; returns what is Begun."""
    pose = [number(x) for x in array(entry["pose"])]
    n_p = context.n_p
    turned = len(pose) == n_p + 1
    need(turned or len(pose) == n_p, f"a pose has {n_p} coordinates, in the plane maybe a heading")
    need(not turned or n_p == 2, "a heading is of the plane")
    p0, k = context.check_sample(entry["sample"])
    # with a heading all is told in the frame of the robot, which starts at its origin
    start = [Fraction(0)] * n_p if turned else pose
    need(p0 == start, "the plan does not start at the pose")
    heading = pose[n_p] if turned else None
    moving = any("steps" in part for part in entry["problem"]["obstacles"])
    return Begun(context, k, number(entry["begin"]), pose[:n_p], heading, moving)


def ended(one):
    """[s] when a manoeuvre comes to its rest."""
    return one.begin + one.context.T * one.context.dt


def follows(one, other, copies, doubt):
    """Does the pose of the other lie in a box around where the one may have been then? copies: the
    first so many points stand for the first one. doubt: half widths [m] of a place, then [rad] of
    the heading, which both poses may be off by.
    """
    context = one.context
    passed = other.begin - one.begin
    need(passed > 0, "it began before the one before it")
    step = min(passed // context.dt, context.T)
    knots = [step] if step in (passed / context.dt, context.T) else [step, step + 1]
    bins = context.bins_meeting(one.k, one.k, closed=True)
    interval, _ = context.errors(bins, max)
    whole_k, scale = integers(one.k)
    _, (y,), y_scale = context.evaluate([whole_k], scale)
    moved, off = displacement(one, other, doubt)
    for axis, sign in itertools.product(range(context.n_p), (1, -1)):
        w = [Fraction(sign * (a == axis)) for a in range(context.n_p)]
        reach = []
        for s, i in itertools.product(knots, range(copies)):
            place = context.offset(s, i)
            at = Fraction(y[place][axis], y_scale) if place.stop else Fraction(0)
            reach.append(sign * at + interval[min(step, context.T - 1)][i].support(w))
        if not sign * moved[axis] <= max(reach) + off:
            return False
    return True


def displacement(one, other, doubt):
    """From the place of the one to that of the other, in the frame of the one, and by how much each
    coordinate may be off.
    """
    way = [b - a for a, b in zip(one.place, other.place, strict=True)]
    n_p = len(way)
    need(len(doubt) == n_p + 1 and all(x >= 0 for x in doubt), "a doubt has a part for each axis")
    size = sum(map(abs, way))
    off = 2 * sum(doubt[:n_p]) + doubt[n_p] * size
    if one.heading is None:
        return way, off
    cosine, sine = cosine_and_sine(one.heading)
    turned = [cosine * way[0] + sine * way[1], cosine * way[1] - sine * way[0]]
    return turned, off + OFF * size


def seconds(time):
    """A time to a millisecond."""
    sign = "-" if time < 0 else ""
    whole_s, rest = divmod(round(abs(time) * 1000), 1000)
    return f"{sign}{whole_s}.{rest:03d} s"


def summary_of_episode(report):
    """What was proved and what it rests on, as lines."""
    yield "ACCEPTED. Proved in exact arithmetic, for every trajectory inside the tube:"
    yield f"  {report.manoeuvres} manoeuvres, each from its pose to its end: nothing is touched"
    yield "    that was there for it; each began where the one before may have been left"
    span = f"{seconds(report.begin)} to {seconds(report.end)}"
    yield f"  so from {span}, with the robot at rest at the end of the last one"
    yield f"    (and {report.rests} times in between), nothing is touched"
    if report.moving:
        yield f"NOT PROVED: in {report.moving} manoeuvres obstacles are told of by intervals, as"
        yield "  those that move are, until its rest. They may run into a robot that rests"
    yield "ASSUMED: that a robot rests where a manoeuvre ends, that poses are as the doubt says,"
    yield "  that obstacles were where the file says"
    yield from told(report.claim, report.arithmetic, report.hash)
