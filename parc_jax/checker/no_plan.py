"""Proofs that no plan exists, and exact volumes of safe and unsafe plans.

A proof is a binary tree of boxes over (z, k), z = p_T = p0 + c_T(k). A leaf is checked at its
vertices: each corner of the box of z with each vertex of a cell of the network inside the box of k.
The cells are derived here. Where they are too many, a leaf is checked by bounds of the network over
the box of k instead.
"""

import itertools
import math

from .bounds import OverBox
from .cells import CellVertices, Outputs
from .exact import FRACTION, array, box, combine, dot, fields, integers, need, number, vector, whole
from .hits import hit
from .plans import condition, holds

UNSAFE = ("goal", "start", "hit")


def missed_goal(context, entries, bins):
    """A combination (w, h) of goal rows: an end y with w . y > h violates one of them, in each of
    the bins with an error that it allows.

    An entry is [row, "m"], where all bins have half widths, and a corner of them is the error, or
    [row, "m", error], with an error that all bins allow.
    """
    final = context.at_end(bins)
    rows = []
    for row, _, *error in entries:
        a, b = context.goal[whole(row, 0, len(context.goal) - 1)]
        context.spend(FRACTION * context.n_end + final.cost)
        if error:
            (error,) = error
            error = vector(error, context.n_end)
            need(final.contains(error), "the error of a goal row is outside the tube")
            rows.append((a, b - dot(a, error)))
        else:
            rows.append((a, b - final.support(a)))
    return combine(rows, [[i, m] for i, (_, m, *_) in enumerate(entries)], context.n_end)


class Leaves:
    """Proves leaves of one tree. Its network is known over the last box of k, in both ways."""

    def __init__(self, context):
        self.context = context
        self.vertices = CellVertices(context)
        self.over_box = OverBox(context)

    def check(self, name, what, bounded, lo, hi):
        """Proves that all (z, k) of a box are safe, or miss the goal, or start outside the start
        set, or hit an obstacle; by bounds of the network, or at the vertices of its cells.

        p0 and y are affine on each cell times the box of z, and each condition is affine in them:
        one that holds at all vertices holds everywhere. Several contacts may share a hit, since the
        obstacle grown by body and tube is convex. Unsafe leaves use errors that every bin allows
        which they overlap, since whatever fails for these fails in the bin of each plan. [T30, T35]
        By bounds the same contact holds for all k, at a corner of the box of z. [T36]
        """
        context = self.context
        n = context.n_p
        groups = asked_of(context, name, what, context.bins_meeting(lo[n:], hi[n:], closed=False))
        corners = itertools.product(*zip(lo[:n], hi[:n], strict=True))
        if bounded:
            self.over_box.enter(lo[n:], hi[n:])
            groups = [[self._whatever_k(option) for option in options] for options in groups]
            served = all(some_always_holds(groups, z) for z in corners)
        elif name == "goal" and not any(groups[0][0][0].v[n:]):  # about z alone: any k will do
            k, scale = integers(lo[n:])
            _, (hidden,), scale = context.hidden([k], scale)
            served = some_holds_at(context, [(hidden, scale)], groups, corners)
        else:
            served = some_holds_at(context, self.vertices.of(lo[n:], hi[n:]), groups, corners)
        need(served, f"a {name} leaf fails at one of its vertices")

    def _whatever_k(self, option):
        """Conditions on z alone that make an option's hold for every k in the box; p0 = z - c_T."""
        found = []
        for asked in option:
            row = [0] * self.context.n_outputs
            places = range(self.context.n_outputs)[asked.outputs]
            for place, x in zip(places, asked.v, strict=True):
                row[place] = x
            for axis, x in enumerate(asked.w, self.context.end.start):
                row[axis] -= x
            least, scale = self.over_box.least(row)
            w, c = [x * scale for x in asked.w], least + asked.c * scale
            found.append(asked._replace(w=w, v=[], outputs=slice(0), c=c))
        return found


def some_always_holds(groups, z):
    """Whether the conditions on z of one of the options of a group hold at a corner z."""
    z, z_scale = integers(z)
    options = itertools.chain.from_iterable(groups)
    return any(all(holds(asked, z, z_scale, [], 1) for asked in option) for option in options)


def asked_of(context, name, what, bins):
    """Groups of options of conditions on (p0, y), each of which makes a leaf of this name true. One
    group has to serve a corner of the box of z: one of its options at each vertex of k.
    """
    n = context.n_p
    if name == "safe":
        return [[context.listed_conditions(what, bins)]]
    if name == "goal":  # a combination of goal rows that (z, q) violates
        w, h = missed_goal(context, what, bins)
        return [[[condition("", True, context.along_p0(w), w, context.end, -h)]]]
    if name == "start":  # a combination of start rows that p0 violates
        w, h = combine(context.start, what, n)
        return [[[condition("", True, w, [], slice(0), -h)]]]
    return hit(context, what, bins)


def some_holds_at(context, points, groups, corners):
    """Whether at each corner z one of the groups serves all vertices of k, as (last hidden layer,
    scale): all conditions of one of its options hold for the plan that ends in z.

    One vertex after the other, with the groups that serve each corner at all so far.
    """
    serving = [(*integers(z), groups) for z in corners]
    longest = 1
    for option in itertools.chain.from_iterable(groups):
        for asked in option:
            longest = max(longest, max(x.bit_length() for x in (*asked.w, *asked.v, asked.c)))
    for hidden, scale in points:
        y = Outputs(context, hidden, scale)
        c_T = y[context.end][: context.n_p]
        left = []
        for z, z_scale, some in serving:
            p0 = [x * y.scale - c * z_scale for x, c in zip(z, c_T, strict=True)]
            some = [o for o in some if some_option_holds(context, o, longest, p0, z_scale, y)]
            if not some:
                return False
            left.append((z, z_scale, some))
        serving = left
    return True


def some_option_holds(context, options, longest, p0, z_scale, y):
    """Whether all conditions of one of the options hold for outputs y and p0, over both scales."""
    for option in options:
        products = len(option) * (context.n_p + 2 * context.n_c + context.n_q)
        context.spend(products, longest, y.scale.bit_length())
        if all(holds(asked, p0, z_scale * y.scale, y, y.scale) for asked in option):
            return True
    return False


def check_faces(context, faces, lo, hi):
    """Proves that each plan that meets the goal, for errors that all bins allow, has z inside."""
    n = context.n_p
    bins = context.bins_meeting(context.lo, context.hi, closed=True)
    for i, pair in enumerate(array(faces, n)):
        for sign, bound, entries in zip((-1, 1), (-lo[i], hi[i]), pair, strict=True):
            w, h = missed_goal(context, entries, bins)
            unit = [sign * int(i == j) for j in range(context.n_end)]
            need(w == unit, "a face of z has another direction")
            need(h <= bound, "a face of z does not follow from the goal")


def check_no_plan(context, plan):
    """Proves that no (p0, k) is safe, or brackets the volume of those that are: a dict of kind and
    exact volumes.

    (p0, k) -> (z, k) is a bijection that keeps volume [T15, T30, T35, T36]; the leaves tile the box
    of z times the domain, by the way the tree is built.
    """
    fields(plan, ("kind", "z", "faces", "tree"))
    z_lo, z_hi = box(plan["z"], context.n_p)
    lo = z_lo + context.lo
    hi = z_hi + context.hi
    need(all(a < b for a, b in zip(lo, hi, strict=True)), "the box of (z, k) is flat")
    # all bins allow the model itself, and so trajectories that are beside it for a moment only
    need(context.bins_without_model() == 0, "a template excludes the model")
    check_faces(context, plan["faces"], z_lo, z_hi)
    allowed = list(UNSAFE)
    if plan["kind"] != "proved":
        need(plan["kind"] == "bracket", "the kind is neither proved nor bracket")
        allowed += ["safe", "open"]
    leaves = Leaves(context)
    volumes = dict.fromkeys((*UNSAFE, "safe", "open"), 0)
    nodes = iter(plan["tree"])
    stack = [(lo, hi)]
    while stack:
        lo, hi = stack.pop()
        ((name, what),) = next(nodes).items()
        bounded = name == "bounded"
        if bounded:
            ((name, what),) = what.items()
            need(name in UNSAFE, "a bounded leaf is none of those that fail")
        if name == "split":
            axis, at = what
            whole(axis, 0, len(lo) - 1)
            at = number(at)
            need(lo[axis] < at < hi[axis], "a split is outside its box")
            lower_hi = [*hi[:axis], at, *hi[axis + 1 :]]
            upper_lo = [*lo[:axis], at, *lo[axis + 1 :]]
            stack.append((upper_lo, hi))
            stack.append((lo, lower_hi))  # the lower part comes next
        else:
            need(name in allowed, f"a leaf {name!r} has no place here")
            if name != "open":
                leaves.check(name, what, bounded, lo, hi)
            volumes[name] += math.prod(b - a for a, b in zip(lo, hi, strict=True))
            integers([volumes[name]])  # bounds its length
    need(next(nodes, None) is None, "the tree has nodes left over")
    unsafe = sum(volumes[name] for name in UNSAFE)
    return {
        "kind": plan["kind"],
        "safe": str(volumes["safe"]),
        "unsafe": str(unsafe),
        "undecided": str(volumes["open"]),
    }
