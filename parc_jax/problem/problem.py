"""The problem: goal, obstacles, body, start set."""

import dataclasses
from collections import Counter, defaultdict
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from parc_jax.common import struct
from parc_jax.common.arrays import once
from parc_jax.common.errors import InputError, check_kind, check_text, reading
from parc_jax.common.said import slot, together
from parc_jax.common.sets.extent import bounding_box
from parc_jax.common.sets.hpolytope import HPolytope, hpolytope, owned
from parc_jax.common.spelling import counted, listed
from parc_jax.learning.network.predict import Layout
from parc_jax.learning.runs.law import words_of
from parc_jax.learning.system import LARGEST, check_points
from parc_jax.problem.body import Body, Disc, Part, Polygon, body_of, number_of, parts_of, shape
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.problem.world.outlines import Edge

SAME = Fraction(1, 10**9)  # [s] moments of a clock that are one; who makes spans allows for it


class Span(tuple):
    """First and last interval in which an obstacle exists, and what that was made for.

    pair: whole numbers. dt: [s] of an interval. at: [s] of a clock at which the intervals begin.
    of: the commitment whose places the obstacle has; of an answer's file only the name of its loop.
    Each of these None where it is not stated.
    said: what it rests on, a sentence, whose numbers may stand in braces, as "within {0.5} m/s":
    of many that differ in these alone one is told. mover: names whose places these are, of one that
    is told of in several parts: it goes on where a part ends and another of its name begins. One
    that ends " from 2", where its first part begins, is told of from there on, others from 0.
    """

    dt: float | None
    at: float | None
    of: Any
    said: str
    mover: str

    def __new__(cls, pair, dt=None, at=None, of: Any = None, said: str = "", mover: str = ""):
        texts = {"said": said, "mover": mover, "of": of if isinstance(of, str) else ""}
        for name, text in texts.items():
            check_text(f"span: {name}", text)
        self = super().__new__(cls, pair)
        self.dt, self.at, self.of, self.said, self.mover = dt, at, of, said, mover
        return self

    @property
    def told_from(self) -> int:
        """The interval in which its mover's first part begins; 0 for a name that this belies."""
        _, said, first = self.mover.rpartition(" from ")
        return int(first) if said and first.isdecimal() and int(first) <= self[0] else 0

    @property
    def rests_on(self) -> str:
        """`said`, or a sentence about `of`, and where it was before; empty for nothing."""
        told = "That a robot is in the way rests on its manoeuvre, on its staying where that ends, "
        told += f"or on one after it that keeps clear of this plan, of a loop ({self.loop})."
        told = told if self.loop else self.said
        told += "." * (told[-1:] not in ".!?")  # none after no words
        words = f"What is in the way is, before interval {slot(str(self.told_from))} of a plan, "
        words += "counted from 0, nowhere or told of apart."
        return f"{told} {words}".lstrip() if self.told_from else told

    @property
    def loop(self) -> str:
        """The loop of `of`, by its content; empty without one."""
        return "" if self.of is None else getattr(self.of, "loop", self.of)

    @property
    def told_loop(self) -> str:
        """`loop` for a file, with why that is over, if it is: a file does not see it later."""
        over = "" if isinstance(self.of, str) else self.void
        return f"{self.loop}; not any more: what is in the way {over}" if over else self.loop

    @property
    def void(self) -> str:
        """Why its obstacle is not where the commitment's robot is, to end a sentence; or empty."""
        if self.of is None:
            return ""
        if isinstance(self.of, str):
            return "is of a file, which does not see whether its robot follows its manoeuvre yet"
        if not self.of.under_way:
            number = f"number {self.of.number}"
            return f"was made for {number} of a robot that has left that since, or for a copy"
        outside = "was made of a robot that was seen outside of its tube since: stop"
        return outside if self.of.seen_outside else ""


@struct.dataclass
class GoalOfPoints(HPolytope):
    """A goal over the ends of named reference points, in this order, then q: `goal_of_points`."""

    points: tuple[str, ...] = struct.field(pytree_node=False, default=())


@struct.dataclass
class Problem:
    """Reach the goal at t_f, never touch an obstacle. Build with `reach_avoid`, which validates.

    goal: closed polytope over (p_f, q_f); of a robot with several reference points over the ends
        of all of them, point by point, then q_f.
    obstacles: closed polytopes over p.
    body: Disc or Polygon about the first reference point, or a Body of several parts.
    start: polytope over p0, or None for anywhere.
    spans: per obstacle the Span in which it exists, or None for always.
    uncertainty: uncertainty that safe plans are robust to; `Query.nominal` reduces it.
    points: names of the reference points that the goal is about, in its order; a model with others,
        or in another order, is refused. () = not given.
    labels: of p, q, k, as a file tells them, by part; a model with others is refused. () = none.
    """

    goal: HPolytope
    obstacles: tuple[HPolytope, ...]
    body: Disc | Polygon | Body
    start: HPolytope | None = None
    spans: tuple[Span | None, ...] = struct.field(pytree_node=False, default=())
    uncertainty: Uncertainty | None = struct.field(pytree_node=False, default=None)
    points: tuple[str, ...] = struct.field(pytree_node=False, default=())
    labels: tuple[tuple[str, tuple[str, ...]], ...] = struct.field(pytree_node=False, default=())

    @property
    def all_spans(self) -> tuple[Span | None, ...]:
        """`spans`, one entry per obstacle also if none were given."""
        return self.spans or (None,) * len(self.obstacles)

    def told_for(self, steps: int) -> int:
        """Of so many steps the first ones, in which all is told of: up to the end of a span whose
        mover does not go on; 0 where neither a span nor another of its mover begins at `told_from`.
        """
        spans = list(filter(None, self.all_spans))
        begun = {(span.mover, span[0]) for span in spans if span.mover}
        ends = [span[1] + 1 for span in spans if (span.mover, span[1] + 1) not in begun]
        late = [(span.mover, span.told_from) for span in spans if span[0] > span.told_from]
        ends += [0 for one in late if one not in begun]
        return min([steps, *ends])

    @property
    def rests_on(self) -> Counter[str]:
        """What obstacles rest on, as of `together`, each with the most that exist at a time."""
        told = [(x.rests_on, (0.0, np.inf)) for x in self.obstacles if isinstance(x, Edge)]
        told += [(x.rests_on, x) for x in self.spans if x is not None and x.rests_on]
        one, spans, most = together(text for text, _ in told), defaultdict(list), Counter[str]()
        for text, span in told:
            spans[one[text]].append(span)
        for text, of in spans.items():
            first, last = np.sort(np.array(of, float), axis=0).T
            # most exist where one of them begins
            begun = np.searchsorted(first, first, "right") - np.searchsorted(last, first)
            most[text] = int(begun.max())
        return most

    @property
    def parts(self) -> tuple[Part, ...]:
        """The parts of the body, of any kind."""
        return parts_of(self.body)

    def replace(self, **changes) -> "Problem":
        """The problem with changed entries, as `reach_avoid` takes them. Raises InputError."""
        names = [field.name for field in dataclasses.fields(self)]
        if unknown := [name for name in changes if name not in names]:
            raise InputError(
                f"problem: expected entries to change among {', '.join(names)}; got "
                f"{', '.join(unknown)}."
            )
        errors = () if self.uncertainty is None else self.uncertainty.obstacles
        told = {"spans": any(self.spans), "uncertainty": len(errors) > 1}
        for name in told if "obstacles" in changes else ():
            if told[name] and name not in changes:
                raise InputError(
                    f"problem: expected {name} beside new obstacles: the old ones have an entry "
                    f"each; got obstacles alone. Give {name} too, as to `reach_avoid`."
                )
        entries = {name: getattr(self, name) for name in names} | changes
        points, given = entries.pop("points"), entries.pop("labels")
        if all(span is None for span in entries["spans"] or ()):
            entries["spans"] = None  # of however many obstacles
        made = reach_avoid(**entries)
        with reading("labels", "names by part"):
            of = words_of(dict(given) if type(given) is tuple else given)
            named = tuple((part, tuple(words)) for part, words in of.items())
        return dataclasses.replace(made, points=made.points or points, labels=named)

    def __repr__(self) -> str:
        start = "anywhere" if self.start is None else "in a set"
        return (
            f"<Problem: goal of {counted(len(self.goal.b), 'row')} over "
            f"{counted(self.goal.n, 'coordinate')}, "
            f"{counted(len(self.obstacles), 'obstacle')}, {self.body!r}, start {start}>"
        )


def reach_avoid(
    goal,
    obstacles: Sequence,
    body,
    start=None,
    spans: Sequence | None = None,
    uncertainty: Uncertainty | None = None,
) -> Problem:
    """A validated problem: of boxes, too, a number [m] as a disc, pairs. Raises InputError."""
    points = goal.points if isinstance(goal, GoalOfPoints) else ()
    for name, some in (("obstacles", obstacles), ("spans", () if spans is None else spans)):
        if not np.iterable(some):
            raise InputError(f"{name}: expected a list, an entry for each; got {some!r:.60}.")
    # in arrays of its own: else the problem, and its certificate, could be changed later
    goal = owned(goal, "goal")
    obstacles = tuple(o if isinstance(o, Edge) else owned(o, "obstacle") for o in obstacles)
    start = None if start is None else owned(start, "start")
    body = body_of([body]) if isinstance(body, Body) else shape("body", body)
    # where none of these tells of the workspace the model will: a goal may be of several points
    known = [s.n for s in (*obstacles, start) if s is not None]
    polygons = [x.shape.vertices for x in parts_of(body) if isinstance(x.shape, Polygon)]
    n_p = next(iter([*known, *(corners.shape[1] for corners in polygons)]), None)
    _require_in_workspace(obstacles, start, n_p)
    if n_p is not None and goal.n < n_p:
        raise InputError(
            f"goal: expected at least the {n_p} workspace coordinates (p, q); got {goal.n} "
            "dimensions."
        )
    for i, part in enumerate(parts_of(body)):
        if isinstance(part.shape, Polygon) and part.shape.vertices.shape[1] != n_p:
            raise InputError(
                f"body: expected vertices in the {n_p}-D workspace; part {i} has "
                f"{part.shape.vertices.shape[1]} coordinates."
            )
    spans = (None,) * len(obstacles) if spans is None else tuple(spans)
    if len(spans) != len(obstacles):
        raise InputError(f"spans: expected one per obstacle ({len(obstacles)}); got {len(spans)}.")
    for j, span in enumerate(spans):
        pair = span if isinstance(span, tuple | list) and len(span) == 2 else (1, 0)
        whole = all(isinstance(i, int | np.integer) and not isinstance(i, bool) for i in pair)
        if span is not None and not (whole and 0 <= pair[0] <= pair[1]):
            raise InputError(
                f"span of obstacle {j}: expected whole numbers 0 <= first <= last; got {span}."
            )
        if span is not None and isinstance(obstacles[j], Edge):
            raise InputError(
                f"span of obstacle {j}: expected none for an edge of free space, beyond which "
                f"nothing is known at any time; got {tuple(span)}."
            )
    spans = tuple(s if s is None or isinstance(s, Span) else Span(s) for s in spans)
    moments = [s.at for s in spans if s is not None and s.at is not None]
    if moments and not max(moments) - min(moments) <= SAME:
        raise InputError(
            f"spans: expected obstacles told for one moment, when the plan begins; some were made "
            f"for {min(moments)!r} s of the clock, others for {max(moments)!r} s."
        )
    if uncertainty is not None:
        check_kind("uncertainty", uncertainty, Uncertainty)
        if n_p is not None:
            uncertainty.shifts(n_p)
        errors = uncertainty.of_obstacles(len(obstacles))
        _require_in_workspace(errors, None, n_p, "uncertainty of obstacle")
    return Problem(goal, obstacles, body, start, spans, uncertainty, points)


def _require_in_workspace(
    obstacles: Sequence[HPolytope | None],
    start: HPolytope | None,
    n_p: int | None,
    kind: str = "obstacle",
) -> None:
    """Raises InputError for sets of another dimension; None for no set."""
    for name, part in [*((f"{kind} {j}", o) for j, o in enumerate(obstacles)), ("start", start)]:
        if part is not None and part.n != n_p:
            raise InputError(f"{name}: expected a set in the {n_p}-D workspace; got {part.n}-D.")


def require_points(problem: Problem, points: Sequence[str]) -> None:
    """Raises InputError where the goal was made for reference points other than these."""
    if problem.points and problem.points != tuple(points):
        raise InputError(
            f"goal: expected the reference points of this model, {', '.join(points)}, in this "
            f"order; it was made for {', '.join(problem.points)}. Make it with "
            "goal_of_points(model.points, ...)."
        )


def require_dimensions(problem: Problem, robot: Any) -> None:
    """Raises InputError where a problem does not fit a robot: a model, or a `Subject`."""
    n_p, n_q, points = robot.n_p, robot.n_q, robot.points
    if n_p not in (2, 3):
        hint = "Add one that stays 0" if n_p < 2 else "States beside the place are q"
        raise InputError(f"robot: expected a workspace of x, y or x, y, z; got {n_p} axes. {hint}.")
    require_points(problem, points)
    if problem.labels:
        own = robot.claim.subject if hasattr(robot, "claim") else robot
        hint = "Leave [labels] out, or take the model's."
        own.agree("[labels] of the scene", own.with_labels(dict(problem.labels)), hint=hint)
    polygons = [part for part in problem.parts if isinstance(part.shape, Polygon)]
    if polygons and robot.rotation is not None:
        raise InputError(
            "body: expected one that turns with this robot, whose heading is declared "
            "(`rotation`): discs, or hulls of reference points; got a polygon, which never turns."
        )
    for j, span in enumerate(problem.all_spans):
        if span is not None and span.dt not in (None, robot.time.dt):
            raise InputError(
                f"span of obstacle {j}: expected intervals of {robot.time.dt!r} s, those of this "
                f"model; it was made for intervals of {span.dt!r} s. Make it with model.time."
            )
    n_y = len(points) * n_p + n_q
    if problem.goal.n != n_y:
        of_all, hint = "", "Give bounds for every one of them."
        if len(points) > 1:
            of_all = f" of each of its {len(points)} points"
            q = f", q=...), q over {counted(n_q, 'coordinate')}." if n_q else ")."
            hint = f"Make it with goal_of_points(model.points, where{q}"
        raise InputError(
            f"goal: expected a set over the {n_p} workspace coordinates{of_all} and "
            f"{n_q} further goal coordinates of this model ({n_y}); got {problem.goal.n} "
            f"dimensions. {hint}"
        )
    _require_in_workspace(problem.obstacles, problem.start, n_p)


def goal_of_points(points: Sequence[str], where, q=None) -> GoalOfPoints:
    """A goal over the ends of several reference points, for `reach_avoid`. Raises InputError.

    points: names of all points of the robot, as `model.points`.
    where: one Box or HPolytope for the ends of all of them ("the car inside the bay"), or a dict
        of such sets by name. The first point needs a bounded set: plans are drawn by its end.
    q: Box or HPolytope of the further goal states, if any.
    """
    points = check_points("goal", points.tolist() if isinstance(points, np.ndarray) else points)
    given = where if isinstance(where, dict) else dict.fromkeys(points, where)
    numbers = {number_of(name, points, "goal"): region for name, region in given.items()}
    if not given or len(numbers) < len(given):
        raise InputError(
            "goal: expected a set for at least one reference point, and one for each that is "
            f"named; got {listed([repr(name) for name in given]) if given else 'none'}."
        )
    regions = [(i, owned(r, f"goal of {points[i]}")) for i, r in sorted(numbers.items())]
    n_p = regions[0][1].n
    for i, region in regions:
        if region.n != n_p:
            raise InputError(
                f"goal: expected sets of one dimension for all points; {points[i]} has {region.n}, "
                f"not {n_p}."
            )
    blocks, n = [(i * n_p, region) for i, region in regions], len(points) * n_p
    if q is not None:
        blocks.append((n, owned(q, "goal of q")))
        n += blocks[-1][1].n
    A = [np.pad(r.A, ((0, 0), (first, n - first - r.n))) for first, r in blocks]
    rows = hpolytope(np.concatenate(A), np.concatenate([r.b for _, r in blocks]))
    return GoalOfPoints(rows.A, rows.b, points)


def finite_box(
    poly: HPolytope, name: str, needed: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """The smallest box around a polytope, as corners lo, hi (n,).

    needed: (n,) bool, axes along which it must be bounded; by default all.
    Raises InputError where it is unbounded there, or empty.
    """
    needed = np.ones(poly.n, bool) if needed is None else needed
    lo, hi = box_of_rows(poly)
    # rows along one axis are read off, others need LPs
    if (np.count_nonzero(poly.A, axis=1) != 1).any():
        around = bounding_box(poly, name)
        lo, hi = np.maximum(lo, around.lo), np.minimum(hi, around.hi)
    return _bounded(lo, hi, needed, name)


def goal_box(goal: HPolytope, layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """A box around the goal, as corners lo, hi (n_c + n_q,). The first reference point and q must
    be bounded, others may be infinite. Raises InputError.
    """
    return once(goal, _goal_box, layout)  # it may take LPs, and a query needs it three times


def _goal_box(goal: HPolytope, layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    if layout.n_points == 1:
        return finite_box(goal, "goal")
    needed = np.ones(goal.n, bool)
    needed[layout.n_p : layout.n_c] = False
    lo, hi = box_of_rows(goal)
    # rows along single axes suffice, and are quicker than LPs
    if (np.isfinite(lo) & np.isfinite(hi))[needed].all():
        return _bounded(lo, hi, needed, "goal")
    return finite_box(goal, "goal", needed)


def box_of_rows(poly: HPolytope) -> tuple[np.ndarray, np.ndarray]:
    """The box of the rows along one axis each, as corners lo, hi (n,); infinite where none is."""
    lo, hi = np.full(poly.n, -np.inf), np.full(poly.n, np.inf)
    single = np.count_nonzero(poly.A, axis=1) == 1
    row, axis = np.nonzero(poly.A * single[:, None])
    slope = poly.A[row, axis]
    bound, above = poly.b[row] / slope, slope > 0
    np.minimum.at(hi, axis[above], bound[above])
    np.maximum.at(lo, axis[~above], bound[~above])
    return lo, hi


def _bounded(lo: np.ndarray, hi: np.ndarray, needed: np.ndarray, name: str):
    """lo, hi, if the needed axes are bounded and none is empty. Raises InputError."""
    open_ = needed & ~(np.maximum(-lo, hi) <= LARGEST)  # of larger ones no volume is a float
    if open_.any():
        axis = int(np.argmax(open_))
        raise InputError(
            f"{name}: expected a bounded set; axis {axis} has no bound up to {LARGEST:g}. Add "
            "the missing rows."
        )
    if (lo > hi).any():
        axis = int(np.argmax(lo > hi))
        span = f"[{lo[axis]:g}, {hi[axis]:g}]"
        raise InputError(f"{name}: expected a set with points; axis {axis} asks for one in {span}.")
    return lo, hi
