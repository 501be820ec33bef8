"""Movers with tubes of their own: learned from logged tracks, obstacles with spans of a loop. [T43]

A track is what was logged of one mover: times and places in the plane. Who moves is assumed to
ignore the robot, and to come from the law of the tracks.
"""

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from parc_jax.common.arrays import as_float64, content_hash
from parc_jax.common.errors import InputError, check_count, check_kind, reading
from parc_jax.common.said import slot, without_braces
from parc_jax.common.sets.box import box
from parc_jax.common.sets.hpolytope import HPolytope, hpolytope
from parc_jax.common.spelling import counted, exact, rounded_down, rounded_up
from parc_jax.learning.bound.error_set import at as errors_at
from parc_jax.learning.bound.statement import assumes, confidence_of, count_of
from parc_jax.learning.model import TrajectoryModel, check_model
from parc_jax.learning.network.predict import trajectories
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.loaders import recorded
from parc_jax.learning.system import ONE_POINT, TimeGrid
from parc_jax.problem.body import Body, Disc, Polygon, numbered
from parc_jax.problem.problem import SAME, Span
from parc_jax.problem.world.moving import spans_of

SIDES = 8  # of the polytope that holds a mover
SLACK = 1e-6  # [m] outwards: more than floats round a place within 1e5 m by and SAME takes away
TURN = 3.15  # [rad] a bit more than half a turn
ABOUT = 1e-6  # [s] times of tracks that are one
EVENLY = "from a moment drawn evenly"  # of windows that may bound: each moment is alike


class Mover(NamedTuple):
    """A mover as seen: at [s] of the clock at place (2,) [m], on its way along heading [rad], 0 of
    who stands; k (2,): speed [m/s] over the last step [s], its turn [rad] against the one before.
    """

    at: float
    place: np.ndarray
    heading: float
    k: np.ndarray
    step: float


class Moving(NamedTuple):
    """Obstacles and their spans, as of `Loop.step`, until `until` [s] after the robot's pose; said:
    until when, against whom, with which probability they hold.
    """

    obstacles: list[HPolytope]
    spans: list[Span]
    until: float
    said: str


def see_mover(times: ArrayLike, places: ArrayLike, step: float) -> Mover:
    """A mover from its last three places, `step` [s] apart, measured as those of the tracks of
    `mover_runs`, errors included. Raises InputError for other times, as of a track with gaps.
    """
    places = as_float64("see_mover places", places, (3, 2))
    gaps = np.diff(times := as_float64("see_mover times", times, (3,)))
    if not (np.abs(gaps - step) <= ABOUT).all():
        raise InputError(
            f"see_mover: expected places {step:g} s apart, as of the tracks that the model was "
            f"learned from; these are {gaps[0]:g} and {gaps[1]:g} s apart."
        )
    heading, k = _seen(places, step)
    return Mover(float(times[-1]), places[-1], float(heading), k, step)


def _labels(step: float) -> dict[str, tuple[str, ...]]:
    """By which a model is one of movers seen by such steps."""
    k = (f"speed over {step:g} s [m/s]", f"turned in {step:g} s [rad]")
    return {"k": k, "p": ("ahead [m]", "left [m]")}


def _seen(places: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Heading (...) and k (..., 2) of three places (..., 3, 2)."""
    before, last = np.moveaxis(np.diff(places, axis=-2), -2, 0)
    heading = np.arctan2(last[..., 1], last[..., 0])
    turned = heading - np.arctan2(before[..., 1], before[..., 0])
    # who stands has no direction; `said` tells that it is told along x
    turned = np.where(np.linalg.norm(before, axis=-1) > 0, turned, 0.0)
    turned = np.arctan2(np.sin(turned), np.cos(turned))
    return heading, np.stack([np.linalg.norm(last, axis=-1) / step, turned], axis=-1)


@reading("mover_runs", "tracks of times and places, a name, and numbers")
def mover_runs(
    tracks: Sequence[tuple[ArrayLike, ArrayLike]],
    time: TimeGrid,
    *,
    of: Sequence[str],
    step: float,
    most: float,
    name: str = "tracks",
    every: float | None = None,
    rng: np.random.Generator | None = None,
    bridge: float | None = None,
) -> RolloutBatch:
    """Windows of logged tracks as runs for `pj.learn`: k as of `Mover`, p in the frame of the mover
    at the beginning of the window, ahead along x. Raises InputError.

    tracks: times (n,) [s] and places (n, 2) [m] of each. time: the grid of a window. of: name of
    the mover of each track; pieces of one are one group, and so one unit of a bound. step: [s]
    between the places from which a mover is seen. most: [m/s] greatest speed. name: of the law.
    every: [s] between windows of a track; for training. rng: instead one window of each track, at a
    time drawn evenly from those whose window is all within it; as `holdout`, the only one that
    `mover_obstacles` takes. bridge: [s] between places up to which the mover is taken to have gone
    straight, by default a step, and two record steps at most.
    """
    every = every if every is None else float(as_float64("mover_runs every", every, ()))
    n, movers = (len(x) if hasattr(x, "__len__") else 0 for x in (tracks, of))
    drawn = isinstance(rng, np.random.Generator) if every is None else rng is None and every > 0
    if not drawn or not 0 < n == movers:
        raise InputError(
            f"mover_runs: expected tracks, one of every > 0 s and rng, and the mover of each of "
            f"{n} tracks; got every = {every}, rng = {rng} and {movers} in of."
        )
    bridge = min(step, 2 * time.dt_record) if bridge is None else bridge
    rows, groups = [], []
    offsets = np.concatenate([[-2 * step, -step], time.dt_record * np.arange(time.n_record + 1)])
    for number, (times, places) in enumerate(tracks):
        times = as_float64("track times", times, (None,))
        places = as_float64("track places", places, (len(times), 2))
        gaps = np.diff(times)
        if len(times) < 2 or not (0 < gaps.min() <= gaps.max() <= bridge + ABOUT):
            raise InputError(
                f"track {number}: expected at least two increasing times, {bridge:g} s apart at "
                f"most (bridge); it has a gap of {gaps.max(initial=0.0):.3g} s. Leave out what was "
                "logged twice, and cut a track where its mover was lost."
            )
        fastest = (np.linalg.norm(np.diff(places, axis=0), axis=1) / gaps).max()
        if not fastest <= most:
            raise InputError(
                f"track {number}: expected at most {most:g} m/s; it jumps with {fastest:.3g} m/s. "
                "Cut it there: it is two movers, or one that was lost."
            )
        first, last = times[0] + 2 * step, times[-1] - time.t_f + ABOUT
        if not first < last:
            raise InputError(
                f"track {number}: expected at least {2 * step + time.t_f:g} s of it, two steps and "
                f"a window; it has {times[-1] - times[0]:.3g} s. Try a shorter time grid."
            )
        starts = np.arange(first, last, every) if rng is None else rng.uniform(first, last, 1)
        at = starts[:, None] + offsets
        rows.append(np.stack([np.interp(at, times, column) for column in places.T], axis=-1))
        groups.append(np.full(len(starts), of[number]))
    seen = np.concatenate(rows)
    heading, k = _seen(seen[:, :3], step)
    x, y = np.moveaxis(seen[:, 2:] - seen[:, 2:3], -1, 0)
    cos, sin = np.cos(heading)[:, None], np.sin(heading)[:, None]
    p = np.stack([cos * x + sin * y, cos * y - sin * x], axis=-1)
    domain = box([0.0, -TURN], [most, TURN])
    placed = EVENLY if every is None else f"every {every:g} s"
    cut = {
        "window": f"one of {time.t_f:g} s within each track, {placed}, seen by steps of {step:g} s",
        "records": f"straight between places, {bridge:g} s apart at most",
    }
    about = {"poses": np.concatenate([at for _, at in tracks])}
    about |= {"time": time, "groups": np.concatenate(groups), "labels": _labels(step)}
    return recorded(name, k, p, np.zeros((len(k), 0)), ONE_POINT, domain, "logged", cut, **about)


def mover_obstacles(
    model: TrajectoryModel,
    movers: Sequence[Mover],
    radius: float,
    time: TimeGrid,
    at: float,
    *,
    until: float | None = None,
    every: int = 1,
) -> Moving:
    """All places that movers may be at while a manoeuvre is under way, as obstacles with spans: the
    tube of each, grown by its radius. [T43] Raises InputError.

    model: learned from `mover_runs`. radius: [m] of a disc that holds a mover. time: of the robot's
    model. at: [s] of the clock, when the robot's pose is measured; a mover is seen then or before.
    until: [s] after that, to which they are obstacles, up to a whole interval; None = as long as
    the manoeuvre. every: intervals of the robot per polytope.
    """
    check_model(model)
    check_kind("mover_obstacles time", time, TimeGrid)
    check_count("mover_obstacles every", every, 1, "1")
    radius = float(as_float64("mover_obstacles radius", radius, ()))
    most = float(as_float64("mover_obstacles until", time.t_f if until is None else until, ()))
    steps = time.n_steps if until is None else math.ceil(most / time.dt - ABOUT)
    if not (radius > 0 and 1 <= steps <= time.n_steps):
        raise InputError(
            f"mover_obstacles: expected a radius above 0 m and until within the manoeuvre, "
            f"{time.t_f:g} s; got {radius!r} and {until!r}."
        )
    obstacles, names = [], []
    parts = spans_of(0, steps - 1, every)
    for mover in movers:
        age = at - mover.at
        if not -ABOUT <= age <= model.time.t_f - steps * time.dt + ABOUT:
            raise InputError(
                f"mover_obstacles: expected a mover that was seen at the pose or up to "
                f"{model.time.t_f - steps * time.dt:.2g} s before it, by one clock; this one was "
                f"seen {age:.3g} s before it."
            )
        if not _labels(mover.step).items() <= model.labels._asdict().items():
            raise InputError(
                f"mover_obstacles: expected a model of `mover_runs` for steps of {mover.step:g} s, "
                f"as this mover was seen; got one with k = {', '.join(model.labels.k)}."
            )
        k, tube = mover.k[None], model.tube
        if not (model.domain.contains(k)[0] and tube.claimed[tube.bins_of(k)].all()):
            raise InputError(
                f"mover_obstacles: expected a mover within the law of its tracks, up to "
                f"{model.domain.hi[0]:.3g} m/s, in a bin of K with a claim; this one goes "
                f"{k[0, 0]:.3g} m/s, turned by {k[0, 1]:.3g} rad. Try more tracks, or fewer bins."
            )
        ends = max(age, 0.0) + time.dt * (np.array(parts) + np.array([0, 1]))
        A = directions(mover.heading)
        reach = reach_of(model, mover.k, Disc(radius), directions(0.0)) + A @ mover.place
        reach += SLACK + ABOUT * model.domain.hi[0]  # who goes as fast as its law has
        obstacles += polytopes(A, reach, model.time.dt, ends.tolist())
        names.append(f"{content_hash(A, reach)[:12]} from 0")
    n, eps, p = len(movers), model.claim.eps, model.claim.premises
    some = counted(n, "mover") if n else "nobody, as none was measured"
    if eps is None:
        held = f"each stays in its tube ({str(p['tube']).removesuffix('.')})"
    else:
        if EVENLY not in str(model.claim.law.cut):
            raise InputError(
                f"mover_obstacles: expected a claim of windows {EVENLY}; got one of "
                f"{model.claim.law.describe()}. Bound it by runs of mover_runs(..., rng=...)."
            )
        alike = "each track alike"
        if "rows" in p:  # movers are counted, each by its worst track
            alike = "each mover alike, then any of its tracks (of all tracks together: nothing)"
        leaves = f", any of which leaves with at most {rounded_up(min(Fraction(1), n * eps))}"
        some += leaves * (n > 0)
        held = (
            f"with confidence {confidence_of(p)} over {count_of(p)[0]:,} {count_of(p)[1]} each "
            f"leaves its tube with probability at most {rounded_up(eps)} from a moment of a track "
            f"of its law, {p['law']}, {alike} however long it lasts (of those present at a moment "
            "more are long), and each of its moments with a window around it alike, "
            "between logged places, too; of several, and of several moments, each drawn so, these "
            "add up"
        )
    law = (
        f"Movers within {slot(exact(radius))} m, until the last interval of each: {held}, if they "
        "ignore the robot, and their places were measured as those of the tracks were, errors "
        "included, in a frame with the same x axis, along which who stands is taken to head. Of "
        f"whoever is not among them nothing is said. {assumes(p)}"
    )
    until = rounded_down(str(steps * time.dt), 3)
    said = f"Until {until} s after the pose at {exact(at)} s, against {some}. {without_braces(law)}"
    spans = [Span(x, time.dt, float(at), None, law, name) for name in names for x in parts]
    return Moving(obstacles, spans, steps * time.dt, said)


def directions(heading: float) -> np.ndarray:
    """(SIDES, 2) in the frame of who has this heading, seen from the world."""
    angles = heading + 2 * np.pi / SIDES * np.arange(SIDES)
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def reach_of(
    model: TrajectoryModel, k: np.ndarray, body: Disc | Polygon | Body, w: np.ndarray
) -> np.ndarray:
    """(T + 1, s) how far all of a body may reach along unit directions w (s, n_p) during each
    interval of a manoeuvre k (n_k,), and at its end, seen from its start, all errors included.
    """
    knots = trajectories(model.net, model.layout, k[None])[0][0]
    knots = np.concatenate([knots, knots[-1:]]).reshape(len(knots) + 1, model.n_points, -1)
    bins = np.atleast_1d(model.tube.bins_of(k[None])[0])
    reach = np.full((len(knots) - 1, len(w)), -np.inf)
    for part in numbered(body, model.points):
        shape = part.shape
        grown = shape.radius if isinstance(shape, Disc) else (w @ shape.vertices.T).max(axis=1)
        for point in part.points:
            along = knots[:, point] @ w.T
            errors = errors_at(model.tube.errors, (bins, slice(None), point))
            # (T, s) of any bin; at rest those of the last interval
            lost = np.asarray(errors.support(w[:, None, None])).max(axis=1).T
            lost = np.concatenate([lost, lost[-1:]])
            reach = np.maximum(reach, np.maximum(along[:-1], along[1:]) + lost + grown)
    return reach


def polytopes(A: np.ndarray, reach: np.ndarray, dt: float, ends: Iterable) -> list[HPolytope]:
    """All places within reach (T + 1, s) along normals A (s, 2), a row for each interval of dt [s]
    and one for ever after, for spans that begin and end at [s]; within SAME of a knot is there.
    """
    found = []
    for begin, end in ends:
        first = min(math.floor((begin + SAME) / dt), len(reach) - 1)
        last = max(math.ceil((end - SAME) / dt), first + 1)
        found.append(hpolytope(A, reach[first:last].max(axis=0)))
    return found
