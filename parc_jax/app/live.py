"""A page in the browser where obstacles, goal and start are dragged, and safe plans follow.

`Live` is all that does not depend on drawing: what was dragged, safe plans of it, its set. The page
around it needs the extra `live` (viser), stays on this machine, and is the same for all browsers.
"""

import itertools
import math
import time
from dataclasses import replace
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.answer.why import SMALL, Why, why_of
from parc_jax.app.plot import shapes
from parc_jax.common.arrays import slices
from parc_jax.common.errors import InputError
from parc_jax.common.said import without_braces
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, from_box, hpolytope
from parc_jax.common.sets.hull import around_box, convex_hull
from parc_jax.common.spelling import exact, listed
from parc_jax.learning.labels import name_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import by_point
from parc_jax.method import Exact
from parc_jax.planner import Planner, Prepared
from parc_jax.problem.body import Disc, numbered
from parc_jax.problem.problem import Problem, box_of_rows, goal_box
from parc_jax.problem.problem_file import problem_text
from parc_jax.problem.robust.nominal import query
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.safe_set.batch.estimate import all_around
from parc_jax.safe_set.corridors.first import MOST, preferred
from parc_jax.safe_set.corridors.sampling import ends_from, ends_of
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import paths_of
from parc_jax.safe_set.verdict.scene import Scene, lowered, padded, pruned_scene, size_class
from parc_jax.safe_set.verdict.screen import screen

HASTE = 0.03  # [s] after which no more plans are looked for while something is dragged
PROPOSED = 4096  # new plans, beside those that were safe before and plans near them
AT_ONCE = 64  # judged in a call, so that the clock is looked at often
NEAR = 0.05  # [sides of K and of the goal]
MOST_OFF = 0.1  # [least side of the goal] of what a slider leaves unknown
# on release: the first corridors hold nine plans in ten and more, further ones take seconds
SOON = Settings(samples=64, target=0.2, work=0.1, proof=False, budget_s=0.5)
PIECES = 12  # of a plan, in each of which the swept body is drawn as one convex set


class Grip(NamedTuple):
    """What is dragged: set as told (None: a pose), middle (n_p,), place, turn, what it rests on."""

    whole: HPolytope | None
    middle: np.ndarray
    place: np.ndarray
    turn: np.ndarray
    rests_on: str = ""

    @property
    def free(self) -> bool:
        """Whether it can be dragged: not an edge of free space, nor what others promise to be."""
        return not self.rests_on  # said of the place as told, not of another one

    def moved(self, n_points: int = 1, heading: int | None = None) -> HPolytope:
        """The set where it is now; of a goal all points' blocks, and its heading with them."""
        if (self.place == self.middle).all() and (self.turn == np.eye(len(self.turn))).all():
            return self.whole
        A, b, n_p = self.whole.A.copy(), self.whole.b.copy(), len(self.place)
        for block in range(0, n_points * n_p, n_p):
            own = A[:, block : block + n_p]
            turned = own @ self.turn.T
            b += turned @ self.place - own @ self.middle
            A[:, block : block + n_p] = turned
        if heading is not None:
            b += A[:, heading] * np.arctan2(self.turn[1, 0], self.turn[0, 0])
        return hpolytope(A, b)


class Drawn(NamedTuple):
    """Safe plans (n, n_p + n_k), largest clearance (n,) [m] first, and [s] from a drag to them."""

    scene: Scene
    plans: np.ndarray
    clearance: np.ndarray
    seconds: float


class Live:
    """A problem that is changed by hand, and its safe plans; no browser.

    at: as of `Planner.solve`. wanted: plans to draw, 16 to 64. Raises InputError.

    k: (2, n_k) of plans and of the set. off: [m] half widths of what is not known of the pose and
    of obstacles, beside what the problem says.
    """

    def __init__(self, model: TrajectoryModel, problem: Problem, at=None, wanted=32, seed=0):
        self.model, self.planner, self.wanted = model, Planner(model), wanted
        self._told, self._key = problem, jax.random.PRNGKey(seed)
        self.k = np.stack([model.domain.lo, model.domain.hi])
        self.off = {"pose": 0.0, "obstacles": 0.0}
        eye, n_p = np.eye(model.n_p), model.n_p
        lo, hi = (side[:n_p] for side in goal_box(problem.goal, model.layout))
        self.most_off = MOST_OFF * float((hi - lo).min())
        self.grips = {"goal": Grip(problem.goal, (lo + hi) / 2, (lo + hi) / 2, eye)}
        parts = [(f"obstacle {j}", o) for j, o in enumerate(problem.obstacles)]
        if at is None and problem.start is not None:
            parts.append(("start", problem.start))
        for (name, part), span in itertools.zip_longest(parts, problem.all_spans):
            corners = shapes.corners_of(part)
            m = (corners.min(axis=0) + corners.max(axis=0)) / 2
            rests_on = getattr(part, "rests_on", "") or getattr(span, "rests_on", "")
            self.grips[name] = Grip(part, m, m, eye, without_braces(rests_on))
        self._rng = np.random.default_rng(seed)
        if at is not None:
            at = np.asarray(at, float)
            self._heading = float(at[n_p]) if len(at) > n_p else 0.0
            self.grips["start"] = Grip(None, at[:n_p], at[:n_p], _turn(self._heading, n_p))
        self.pose_size = None if at is None else len(at)
        whole = lowered(self._nominal())
        self._last = np.zeros((0, whole.model.n_k + n_p))  # shares of what was drawn
        shapes_ = [part.shape for part in whole.problem.parts]
        own = max(0 if isinstance(s, Disc) else len(s.vertices) for s in shapes_)
        # rows of an obstacle, and of a box that it is turned against and grown by
        rows = max((len(o.b) for o in whole.problem.obstacles), default=0) + 2 * n_p
        corners = rows + own if n_p == 2 else (2 * rows - 4) * max(own, 1)
        # one size for every place of everything: nothing compiles while something is dragged
        self._size = size_class(len(whole.obstacles.active)), size_class(corners, 2**n_p)

    def move(self, name: str, place, turn: float | np.ndarray | None = None) -> None:
        """Drag a free grip to a place (n_p,) [m], turned by an angle [rad] or a matrix (n_p, n_p).
        Raises InputError for another one.
        """
        own = self.grips.get(name)
        if own is None:
            raise InputError(f"move: expected one of {', '.join(self.grips)}; got {name!r:.60}.")
        if not own.free:
            raise InputError(f"move: expected a free grip, another than {name}: {own.rests_on}")
        turn = own.turn if turn is None else _turn(turn, len(own.place))
        self.grips[name] = own._replace(place=np.asarray(place, float), turn=turn)

    @property
    def problem(self) -> Problem:
        """As it was dragged. Raises InputError."""
        grips, model = dict(self.grips), self.model
        heading = model.labels.heading if model.n_p == 2 else None
        heading = None if heading is None else model.n_c + heading
        changes: dict = {"spans": self._told.spans, "uncertainty": self._told.uncertainty}
        changes["goal"] = grips["goal"].moved(model.n_points, heading)
        if self.pose_size is None and "start" in grips:
            changes["start"] = grips["start"].moved()
        names = [f"obstacle {j}" for j in range(len(self._told.obstacles))]
        if any(self.off.values()):
            known = self._told.uncertainty or Uncertainty()
            start = (known.shifts(model.n_p) + self.off["pose"]).round(9)  # as it is told
            half = np.full(model.n_p, self.off["obstacles"])
            errors = known.obstacles
            if half.any():  # beside the error that is told of an obstacle, if one is
                by, told = from_box(box(-half, half)), errors or [None]
                wider = (by if x is None else around_box([x], half)[0] for x in told)
                errors = [x.replace(b=x.b.round(9)) for x in wider]  # as it is told
            changes["uncertainty"] = replace(known, start=start, obstacles=errors)
        return self._told.replace(obstacles=[grips[n].moved() for n in names], **changes)

    @property
    def at(self) -> np.ndarray | None:
        """The start's pose as dragged, its heading within half a turn of the told one; or None."""
        if self.pose_size is None:
            return None
        place, turn = self.grips["start"].place, self.grips["start"].turn
        # a goal may be told beyond a turn, and is met from a heading that is told so as well
        turned = math.remainder(np.arctan2(turn[1, 0], turn[0, 0]) - self._heading, 2 * np.pi)
        return np.r_[place, self._heading + turned][: self.pose_size]

    def _nominal(self):
        return query(self.problem, self.model, self.at).nominal(self.planner._robust_models)

    def scene(self, made=pruned_scene) -> Scene:
        """As it was dragged, of the part of K asked for, always of one size. Raises InputError."""
        scene = padded(made(self._nominal()), *self._size)
        axes = self.chosen  # where some are given the others have other columns
        lo, hi = self.k[:, axes]
        lo, hi = np.maximum(lo, scene.k_lo), np.minimum(hi, scene.k_hi)
        if (out := np.flatnonzero(lo > hi)).size:
            name, ends = scene.model.labels.k[out[0]], (scene.k_lo[out[0]], scene.k_hi[out[0]])
            raise InputError(
                f"{name_of(name)}: expected some of {' to '.join(map(exact, ends))}, from where no "
                "error of execution leaves K. Move its slider."
            )
        return scene.replace(k_lo=lo, k_hi=hi)

    @property
    def chosen(self) -> list[int]:
        """Axes of k that are neither given nor unknown."""
        return [self.model.labels.k.index(name) for name in self._nominal().model.labels.k]

    def draw(self, scene: Scene | None = None) -> Drawn:
        """Safe plans, each verified in float64: those of before where they still are, others near
        them, and new ones. scene: by default as it was dragged. Raises InputError.
        """
        # of pruned obstacles is known how far they are at least, not which plan is roomiest
        begin, scene = time.perf_counter(), scene or self.scene(lowered)
        model = scene.model
        near = self._last + NEAR * self._rng.standard_normal((2, *self._last.shape))
        fresh = self._rng.uniform(0, 1, (PROPOSED, model.n_k + model.n_p))
        share = np.concatenate([self._last, np.clip(near, 0, 1).reshape(-1, fresh.shape[1]), fresh])
        p0, k, fits = _aimed(scene, share)
        rows, plans, clearance = np.flatnonzero(fits), [], []
        for some in slices(len(rows), AT_ONCE):
            # a short call repeats its last proposal: one shape, one compiled program
            own = rows[some][np.minimum(np.arange(AT_ONCE), len(rows[some]) - 1)]
            safe = preferred(scene, k[own], MOST, p0=p0[own])
            kept = np.unique(own[safe.rows], return_index=True)[1]
            plans.append(own[safe.rows[kept]])
            clearance.append(safe.clearance[kept])
            found, took = sum(map(len, plans)), time.perf_counter() - begin
            if found >= self.wanted or took > HASTE:
                break
        chosen = np.concatenate([np.zeros(0, int), *plans])
        room = np.concatenate([np.zeros(0), *clearance])
        order = np.argsort(-room, kind="stable")[: self.wanted]
        self._last = share[chosen[order]] if len(order) else self._last
        each = np.concatenate([p0, k], axis=1)[chosen[order]]
        return Drawn(scene, each, room[order], time.perf_counter() - begin)

    def settle(self) -> tuple[Answer | None, Why | None]:
        """A set, in about a second, not proved; why there is none, or few. Raises InputError."""
        drawn, asked, why = self.draw(self.scene()), SOON, None
        if not len(drawn.plans):  # rarer than draws find: a climb looks for one
            why = why_of(drawn.scene)
            if why.missing > 0:
                first = self._too_narrow(drawn.scene)
                return None, replace(why, sentences=(*first, *why.sentences))
            plan = np.split(why.plan, [self.model.n_p])
            asked = SOON.replace(method=Exact(around=(plan[0], plan[1])))
        answer = Prepared(drawn.scene).solve(self._key, asked)
        few = answer.share is None or answer.share.share < SMALL
        return answer, (why or answer.why()) if few else None

    def _too_narrow(self, scene: Scene) -> list[str]:
        """Which sliders of k leave no plan, where wider ones do: a sentence, or none."""
        model, whole = scene.model, scene.model.domain
        k = self.draw(scene.replace(k_lo=whole.lo, k_hi=whole.hi)).plans[:, model.n_p :]
        off = (k < scene.k_lo) | (k > scene.k_hi)
        fewest = min(off, key=np.sum, default=off.any(axis=0))
        names = [name_of(model.labels.k[i]) for i in np.flatnonzero(fewest)]
        return [f"What would help first: wider sliders of {listed(names)}."] if names else []

    def warm_up(self) -> None:
        """Compile what a release needs, for turned obstacles too, which may have more sides."""
        grips, off = dict(self.grips), dict(self.off)
        for turn in (1e-3, 0.0):
            self.off = dict.fromkeys(off, turn * self.most_off)
            for name, grip in ((name, grip) for name, grip in grips.items() if grip.free):
                self.move(name, grip.place, _turn(turn, len(grip.place)) @ grip.turn)
            self.settle()
            why_of(scene := self.scene())
            # a release in a scene without plans screens none
            screen(scene, np.zeros((1, scene.model.n_p)), np.zeros((1, scene.model.n_k)))
        self.grips, self.off = grips, off

    def proved(self) -> Answer:
        """The whole set, proved: as `Planner.solve` gives it."""
        return self.planner.solve(self.problem, self._key, at=self.at)

    def toml(self) -> str:
        """The scene as `parc-jax solve` reads it."""
        return problem_text(self.problem, self.model.labels, self.model.points)


def _aimed(scene: Scene, share: np.ndarray):
    """Plans p0 (b, n_p), k (b, n_k) at shares (b, n_k + n_p) of a box of parameters and where
    the first point may end with each of them, and which of them may be safe (b,).
    """
    model = scene.model
    k = scene.k_lo + share[:, : model.n_k] * (scene.k_hi - scene.k_lo)
    ways, ends, bin = ends_from(0.0, model, k), ends_of(scene), model.tube.bin_of(k)
    if scene.at is not None:
        z = scene.at + ways
        inside = ((ends.z_lo[bin] <= z) & (z <= ends.z_hi[bin])).all(axis=1)
        return np.tile(scene.at, (len(k), 1)), k, inside & (bin >= 0)
    lo, hi = ends.z_lo[bin], ends.z_hi[bin]
    if scene.problem.start is not None:
        first, last = box_of_rows(scene.problem.start)
        lo, hi = np.maximum(lo, first + ways), np.minimum(hi, last + ways)
    z = lo + share[:, model.n_k :] * (hi - lo)
    return z - ways, k, (lo < hi).all(axis=1) & (bin >= 0)


def _turn(angle: float | np.ndarray, n_p: int) -> np.ndarray:
    if np.ndim(angle):
        return np.asarray(angle, float)
    out = np.eye(n_p)
    out[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return out


def swept(scene: Scene, plans: np.ndarray, pieces: int = PIECES, tube: bool = False, at=None):
    """All that the body passes on plans, piece by piece, and with a tube all that it may: vertices
    (v, 3) in the world and triangles (f, 3) for a picture, drawn from inside along directions; and
    the way of the first point, (n, T + 1, 3). at: knots, for the body there alone.
    """
    model, n_p = scene.model, scene.model.n_p
    if not len(plans):
        return np.zeros((0, 3)), np.zeros((0, 3), int), np.zeros((0, model.time.n_steps + 1, 3))
    u = all_around(n_p).astype(float)  # directions, and triangles between them
    flat = [[0, i, i + 1] for i in range(1, len(u) - 1)]
    fan = np.array(flat) if n_p == 2 else convex_hull(u).simplices
    path = paths_of(model, plans[:, :n_p], plans[:, n_p:])
    places = by_point(path, model.n_points)
    last = places.shape[1] - 1
    knots = np.unique(np.linspace(0, last, min(pieces, last) + 1).round().astype(int))
    spans = list(itertools.pairwise(knots)) if at is None else [(t, t) for t in at]
    half = np.zeros((len(plans), last, model.n_points, n_p))
    if tube:
        half = by_point(model.tube.widest_at(plans[:, n_p:])[0], model.n_points)
    out = [np.zeros((0, len(u), n_p))]
    for part in numbered(scene.problem.body, model.points):
        points, shape = list(part.points), part.shape
        corners = np.zeros((1, n_p)) if isinstance(shape, Disc) else shape.vertices
        own = corners[(corners @ u.T).argmax(axis=0)]
        own = own + (shape.radius * u if isinstance(shape, Disc) else 0.0)
        for first, end in spans:
            some = places[:, first : end + 1, points].reshape(len(plans), -1, 1, n_p)
            wide = half[:, first : max(end, first + 1), points].max(axis=1, initial=0.0)
            wide = np.sign(u) * np.tile(wide, (1, end + 1 - first, 1))[:, :, None]
            reached = some + wide
            best = (reached * u).sum(axis=-1).argmax(axis=1)
            out.append(np.take_along_axis(reached, best[:, None, :, None], axis=1)[:, 0] + own)
    hulls = shapes.in_world(np.concatenate(out), scene.nominal.pose)
    faces = fan + len(u) * np.arange(len(hulls))[:, None, None]
    way = shapes.in_world(places[:, :, 0], scene.nominal.pose)
    return hulls.reshape(-1, 3), faces.reshape(-1, 3), way


def live(source, problem: Problem | None = None, at=None, port: int = 8080, wait: bool = True):
    """Open a page on this machine where obstacles, goal and start are dragged by hand: while they
    move, safe plans are redrawn with the body on its way; on release the set is measured, and where
    it is empty, what is in the way.

    source: an answer, or a model with its problem. at: as of `Planner.solve`. port: of this machine
    alone, or the next that is free. wait: until interrupted; False returns the page, of which
    `run()` waits and `stop()` ends it. Needs the extra `live`. Raises InputError.
    """
    if isinstance(source, Answer):
        asked = source.scene.nominal.query
        if asked is None:  # its scene is turned and grown already, and would be once more
            raise InputError(
                "live: expected an answer that knows its question; a file in the robot's frame, or "
                "under an uncertainty, does not. Give the model and the problem, with its `at`."
            )
        problem, source = asked.problem, asked.model
        at = asked.pose.values if at is None and asked.pose is not None else at
    if not isinstance(source, TrajectoryModel) or not isinstance(problem, Problem):
        raise InputError(
            "live: expected an answer, or a model and a problem; got "
            f"{type(source).__name__} and {type(problem).__name__}. pj.load(path) reads a model, "
            "pj.exchange.load_problem(path) a problem."
        )
    from parc_jax.app.live_page import Page

    page = Page(Live(source, problem, at), port)
    if wait:
        page.run()
    return page
