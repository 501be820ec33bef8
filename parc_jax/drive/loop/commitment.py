"""Manoeuvres that a loop committed to: where each may lead; whether a tube was left. [T38, T40]"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from parc_jax.checker.rests_on import IN_THE_WORLD, ON_THE_ROBOT, part_of
from parc_jax.common.arrays import Sealed, as_float64, content_hash
from parc_jax.common.errors import InputError, reading
from parc_jax.common.premises import MEASURED, Premises, agree, premises, text_of
from parc_jax.common.spelling import exact, rounded_down
from parc_jax.drive.loop.statement import about_drift
from parc_jax.learning.bound.measure import allowance, kept
from parc_jax.learning.bound.statement import UNSHOWN, in_short
from parc_jax.learning.labels import name_of
from parc_jax.learning.network.predict import trajectories
from parc_jax.problem.body import parts_of
from parc_jax.problem.robust.nominal import NominalProblem
from parc_jax.problem.robust.pose import Pose
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import answer_part, body_part, sample_part
from parc_jax.safe_set.verdict.pointwise import paths_of
from parc_jax.safe_set.verdict.scene import scene_along
from parc_jax.statement import resting_on

if TYPE_CHECKING:
    import shapely

AT_ONCE = 64  # manoeuvres scored in one compiled call
ROUNDED = 1e-9  # [m] more than floats round places up to 1e5 m by: so far inside is outside
SAME = Fraction(1, 10**6)  # [s] moments of a clock that are one: they come as floats
WHOLE = 1e-3  # [records] a manoeuvre that begins so near to one begins there
STOOD = 0.01  # [m] a robot that moves less has stood
HEADING = "told of no pose: each manoeuvre begins with that of the model's runs"
START = "not measured: each manoeuvre begins as the model's runs did, whatever was driven before"

COPIED = "it was copied, and no pose outside of its tube was seen since"


class Begun(list):
    """What one episode of a loop has under way, when [s] each of its manoeuvres began and the robot
    was seen outside of a tube, and what else is assumed of it, by name; of copies nothing is known
    to be under way, nor what was seen of it since.
    """

    begins: tuple[Fraction, ...] = ()
    outside: tuple[Fraction, ...] = ()
    assumed: Mapping[str, Any] = {}
    copied = False

    def __reduce__(self):
        return type(self), (), vars(self) | {"copied": True}


@dataclass(frozen=True, eq=False)
class Commitment(Sealed):
    """One manoeuvre, safe over all of its time for every run inside the tube; that the robot rests
    at its end is assumed. [T38] Proved in float64 with the margin that covers rounding; `proved`
    and `certificate` have the exact proof.

    number: from 0. begin, end: [s] of the loop's clock, from its pose to its end. k (n_k,): values
    measured at the start, and the command. clearance: [m] from everything, of every run inside the
    tube. judged: candidates that had a verdict. asked: the nominal problem, from the pose. drift:
    [m] that was allowed for since the one before, as of `Loop.step`. drifted: [m] all of that in
    its episode. seen_outside: [s] of the clock when a pose was outside of its tube; the loop adds
    them, and files tell of the first. episode: one list for all commitments of an episode of one
    loop, of the one under way. command: when it is given, in words, where not at its begin. given:
    the axes of k that were measured at the start, or are the command then under way.
    """

    number: int
    begin: Fraction
    end: Fraction
    k: np.ndarray
    clearance: float
    judged: int
    asked: NominalProblem
    drift: float = 0.0
    drifted: float = 0.0
    seen_outside: list[Fraction] = field(default_factory=list)
    episode: Begun = field(default_factory=Begun)
    command: str = ""
    given: tuple[int, ...] = ()

    def __repr__(self) -> str:
        until = f" until {exact(self.told_until)} s" if self.told_until < self.end else ""
        under = UNSHOWN.get(self.asked.model.claim.kind, "")
        clear = f"{rounded_down(self.clearance, 3)} m clear{until}{under}"
        if self.seen_outside:  # what was proved is of another run
            clear = f"its tube left by {exact(self.seen_outside[0])} s"
        elif self.others_left:
            clear = self.others_left
        return (
            f"<Commitment {self.number}: k = ({', '.join(map(exact, self.k))}) from "
            f"{exact(self.begin)} s to its end at {exact(self.end)} s, {clear}>"
        )

    @property
    def under_way(self) -> bool:
        """Whether its robot still drives it: its loop began nothing else. False of copies."""
        return self in self.episode

    @property
    def told_until(self) -> Fraction:
        """[s] of the clock up to which all is told of, as of `Problem.told_for`."""
        time = self.asked.model.time
        return self.begin + Fraction(time.dt) * self.asked.problem.told_for(time.n_steps)

    @property
    def others_left(self) -> str:
        """That a robot in its way was seen outside of its tube while it was driven; or empty."""
        until = next((t for t in self.episode.begins if t > self.begin), self.end)
        spans = filter(None, self.asked.problem.all_spans)
        others = [span.of for span in spans if isinstance(span.of, Commitment)]
        # in what it drives after that, beside this one, too
        seen = [t for x in others for t in x.episode.outside if t <= until]
        return f"a robot in its way left its tube by {exact(min(seen))} s" if seen else ""

    def proved(self) -> bool:
        """Check it exactly, in some milliseconds."""
        return bool(prove(self.asked.problem, self.asked.model, [self.part])[0][0])

    def certificate(self) -> dict:
        """A file for the checker: the question from this pose, and the plan as its one sample."""
        asked, pose = self.asked, self.asked.pose
        times: dict = {"begin": str(self.begin), "end": str(self.end)}
        told = [f"start {START}"] * ("START" in self.untold)
        told += [self.command] * bool(self.command)
        k = [f"{name_of(asked.model.labels.k[i])} = {exact(self.k[i])}" for i in self.given]
        told += [f"what is measured of its k was so at its begin: {', '.join(k)}"] * bool(k)
        told += self.assumed
        told += [about_drift(self.drifted)] * bool(self.drifted)
        told += [f"its tube was left by {float(t)!r} s" for t in self.seen_outside[:1]]
        told += filter(None, [self.others_left])
        times["rests_on"] = [*resting_on(asked), *told]
        meta = {"pose": [*pose.place.tolist(), pose.heading]} | times
        return answer_part(asked.problem, asked.model, [self.part], [], [], no_plan=None, meta=meta)

    @property
    def shared(self) -> Premises:
        """Premises that all commitments of one loop have in common."""
        asked, copies = self.asked, copies_of(self.asked)
        model, known = asked.model, asked.query.problem.uncertainty or Uncertainty()
        errors = [content_hash(one.A, one.b) for one in known.obstacles if one is not None]
        told = {
            "model": [model.net.hash, model.tube.hash, model.claim.hash],
            "body": [part_of(x, copies) for x in body_part(asked.problem, model)["parts"]],
            "frame": IN_THE_WORLD if asked.pose.heading is None else ON_THE_ROBOT,
        }
        told |= {x.name: repr(getattr(known, x.name)) for x in fields(Uncertainty)}
        told |= {"obstacles": errors, "command": self.command, "given": list(self.given)}
        return premises((name, MEASURED, value) for name, value in told.items())

    @property
    def untold(self) -> dict[str, str]:
        """What of its begin nothing tells, by name: it is assumed to be that of the runs."""
        told = {"heading": HEADING} if self.asked.pose.heading is None else {}
        return told if self.given else told | {"START": START}

    @property
    def assumed(self) -> list[str]:
        """What else is assumed of its robot, in words."""
        told = [f"{name}: {text_of(value)}" for name, value in self.episode.assumed.items()]
        return told + [COPIED] * self.episode.copied

    @property
    def loop(self) -> str:
        """The loop that committed to it, by its content, in words."""
        model, shared, known = self.asked.query.model, self.shared, self.asked.uncertainty
        by = [f"claim {model.claim.hash[:12]}: {in_short(model.claim)}"]
        by += [f"a body of {'; '.join(shared['body'])}"]
        by += [f"safe for {known.words if known else 'what is measured, exactly'}"]
        given = ", ".join(name_of(model.labels.k[i]) for i in self.given)
        by += [f"what is measured of its k was so ({given})"] * bool(given)
        by += [f"{name.lower()} {told}" for name, told in self.untold.items()]
        by += [f"assumed {told}" for told in self.assumed]
        by += [shared["command"], f"premises {shared.hash[:12]}"]
        return ", ".join([model.system or "unnamed system", *filter(None, by)])

    @property
    def part(self) -> dict:
        """Its certificate, a sample of the checker."""
        path = paths_of(self.asked.model, self.asked.at[None], self.k[None])[0]
        scene = scene_along(self.asked, self.k, path)
        return sample_part(scene, scene.model.tube, self.asked.at, self.k, path)


@dataclass(frozen=True, eq=False)
class Step:
    """The decision of one step. committed: the manoeuvre under way from now on, None before the
    first one. new: it was committed to in this step; else the robot continues it, to its end.
    reason: why there is no new one, else empty. left: the pose is outside of the tube that was
    under way, whatever it may be off by; False inside of it so; None where neither is known.
    """

    committed: Commitment | None
    new: bool
    reason: str = ""
    left: bool | None = None


class LeftTube(InputError):
    """A pose to which the manoeuvre under way cannot have led."""


def copies_of(asked: NominalProblem) -> int:
    """Vertex realisations: points of the nominal problem for each point of the robot."""
    return asked.model.n_points // asked.query.model.n_points


def require_whole(where: str, commitments: Sequence[Commitment]) -> None:
    """Raises InputError unless these follow each other, none left out, in one loop's episode."""
    if not isinstance(commitments, Sequence) or {*map(type, commitments)} != {Commitment}:
        got = f"got {commitments!r:.60}. The first is of a loop's step, or of a Shield's reset."
        raise InputError(f"{where}: expected a list of commitments alone; {got}")
    for one, other in pairwise(commitments):
        agree(f"{where}: commitments of one loop", one.shared, other.shared)
        if other.number != one.number + 1 or one.episode is not other.episode:
            of = "" if one.episode is other.episode else " of another"
            raise InputError(
                f"{where}: expected all that one robot's loop committed to in between in one "
                f"episode; got number {other.number}{of} after {one.number}."
            )


def require_shared(name: str, drifted: float) -> None:
    """Raises InputError for poses that may have drifted [m] from the frame that robots share."""
    if drifted:
        raise InputError(
            f"{name}: expected poses in a frame that both robots share; those of this one may have "
            f"drifted by {drifted:g} m. Tell what they are off by as uncertainty of the start."
        )


@reading("left_tube", "commitments, and places as numbers")
def left_tube(
    commitments: Sequence[Commitment], path: ArrayLike, heading: ArrayLike | None = None
) -> bool:
    """Test whether the robot left a tube in an episode, at any record of the executed part of a
    manoeuvre. A run that rounding might have put outside, or that is not finite, counts as left.

    commitments: all of an episode of one loop, in their order. path: true places of its reference
    points (n, points, n_p), of one point (n, n_p) [m], at the clock's times 0, d, 2 d, ..., d the
    time between records of the model; until the first begins the robot stands, to 1 cm. heading
    (n,) [rad]: of a robot whose poses have one.
    The last manoeuvre counts up to its end, or that of the path. Not tested: rest after it, and
    other goal states (q), which only `end` rests on. Raises InputError.
    """
    require_whole("left_tube", commitments)
    if (first := commitments[0].number) != 0:
        raise InputError(
            f"left_tube: expected all commitments of an episode, from number 0 on; got number "
            f"{first} first. Nobody knows whether the tubes of those before were left."
        )
    model = commitments[0].asked.query.model
    turns = commitments[0].asked.pose.heading is not None
    # places that are not finite are outside of every tube
    path, points, n_p = np.asarray(path, np.float64), model.n_points, model.n_p
    shapes = [(points, n_p)] + [(n_p,)] * (points == 1)
    if path.ndim < 2 or path.shape[1:] not in shapes or len(path) < 2:
        raise InputError(
            f"left_tube: expected places of {points} points in {n_p} axes at each of 2 records or "
            f"more, (n, {points}, {n_p}); got shape {path.shape}."
        )
    path = path.reshape(len(path), points, n_p)
    heading = heading if turns else np.zeros(len(path))
    heading = as_float64("left_tube: heading", heading, (len(path),))
    step, begin = model.time.dt_record, []
    for one in commitments:  # the record at which each began
        record = float(one.begin) / step
        begin.append(round(record))
        if abs(record - begin[-1]) > WHOLE or not 0 <= begin[-1] < len(path):
            raise InputError(
                f"left_tube: expected manoeuvres that began at records of the path, every {step:g} "
                f"s from 0 to {step * (len(path) - 1):g} s; number {one.number} began at "
                f"{exact(one.begin)} s."
            )
    # of what it drove before, after a restart or by hand, nobody knows whether its tube was left
    if not (np.abs(path[: begin[0]] - path[begin[0]]) <= STOOD).all():
        raise InputError(
            "left_tube: expected a robot that stands until the first manoeuvre; got a path that "
            f"moves before {exact(commitments[0].begin)} s. Tell of all manoeuvres; where none was "
            "driven, as of a boat that drifts, repeat the place of that moment before it."
        )
    begun = sum(round(float(t) / step) < len(path) - 1 for t in commitments[0].episode.begins)
    if begun > len(commitments):
        got = f"{begun} began on this path; got {len(commitments)}"
        raise InputError(f"left_tube: expected all commitments of an episode, of which {got}.")
    k = np.stack([one.k for one in commitments])
    knots, q = trajectories(model.net, model.layout, k)
    # at all records, straight between knots
    share = (np.arange(model.time.stride) / model.time.stride)[:, None]
    within = knots[:, :-1, None] * (1 - share) + knots[:, 1:, None] * share
    p = np.concatenate([within.reshape(len(k), -1, model.n_c), knots[:, -1:]], axis=1)
    for i, (first, last) in enumerate(zip(begin, [*begin[1:], len(path) - 1], strict=True)):
        n = min(last - first, model.time.n_record) + 1
        # from the place of the first point at the start, with the heading there
        away = path[first : first + n] - path[first, 0]
        p[i, :n] = turned(away, heading[first]).reshape(n, -1)
    slack = allowance(model.net, model.domain, model.layout)
    for i in range(0, len(k), AT_ONCE):
        some = np.minimum(np.arange(i, i + AT_ONCE), len(k) - 1)  # a short call repeats its last
        if not kept(model.net, slack, model.claim, k[some], p[some], q[some]).all():
            return True
    return False


def outside_tube(last: Commitment, pose: Pose, at: Fraction, k: np.ndarray | None) -> tuple:
    """Distance [m] of a measured pose from the places that a manoeuvre may have led to by a time of
    the clock, of the farthest reference point; 0 inside. [T38] Beside it by how much, along an
    axis, the true one may be outside; less than 0 where all are inside, infinite if not known.

    k (n_k,): with the parameters measured at the pose; its start places the other points. None
    where they are not known: of the first point alone, which is where the pose is.
    The places are a box around the tube, less ROUNDED but no narrower, grown by the uncertainty of
    both poses. A heading shows in the other points alone: it is ignored for a robot of one point.
    """
    asked, begun = last.asked.query, last.asked.pose
    model, known = asked.model, asked.problem.uncertainty or Uncertainty()
    tube, n_p, steps = model.tube, model.n_p, model.time.n_steps
    points = np.s_[:1] if k is None else np.s_[:]
    k = last.k if k is None else k
    (knots, starts), _ = trajectories(model.net, model.layout, np.stack([last.k, k]))
    passed = min(float((at - last.begin) / Fraction(model.time.dt)), float(steps))
    before = min(int(passed), steps - 1)
    way = knots[before] + (passed - before) * (knots[before + 1] - knots[before])
    heading = begun.heading or 0.0
    around = turned(starts[0].reshape(-1, n_p), heading - (pose.heading or 0.0))
    there = turned(pose.place - begun.place, heading) + around
    at_start = tube.interval[tube.bins_of(k[None])[0], 0].max(axis=0)
    at_start[:n_p] = 0.0  # of the first point, which is where the pose is
    # a knot belongs to both its intervals, and a run in the tube is within the narrower one there
    near = float(SAME) / model.time.dt
    both = [min(int(max(passed + off, 0)), steps - 1) for off in (-near, near)]
    bins = tube.bins_of(last.k[None])[0]
    allowed = tube.interval[bins].max(axis=0)[both].min(axis=0) + at_start
    allowed = np.maximum(allowed.reshape(-1, n_p) - ROUNDED, ROUNDED)
    far = np.linalg.norm(there, axis=1) + np.linalg.norm(around, axis=1)
    doubt = 2 * known.shifts(n_p).sum() + known.heading * far[:, None]
    off = np.abs(there - way.reshape(-1, n_p))
    beyond = np.linalg.norm(np.maximum(off - allowed - doubt, 0.0), axis=1)[points].max()
    # what is sure to be inside is so of the tube itself, of every bin, and at the end
    if tube.templates is not None or len(off[points]) < len(off):
        return float(beyond), np.inf
    inside = tube.interval[bins].min(axis=0)[both].min(axis=0)
    inside = inside - tube.halves_around(model.claim.intersample or 0.0, 0.0)[0]  # as `kept`
    if passed + near >= steps:
        inside = np.minimum(inside, tube.final[bins].min(axis=0)[: len(inside)])
    inside = (inside - at_start).reshape(-1, n_p)  # where the others began is not measured
    return float(beyond), float((off - inside + doubt).max() + ROUNDED)


def leads_to(last: Commitment, region: "shapely.Geometry", drift: float) -> bool:
    """Test whether any of the body may enter a region of the plane during a manoeuvre: the hull of
    all its points in each interval, grown by tube, uncertainty, drift [m] and body. Overestimates,
    but for a frame that turned.
    """
    if region.is_empty:
        return False
    from shapely import MultiPoint

    asked, begun = last.asked.query, last.asked.pose
    model, known = asked.model, asked.problem.uncertainty or Uncertainty()
    knots, _ = trajectories(model.net, model.layout, last.k[None])
    away = knots[0].reshape(-1, model.n_points, model.n_p)
    places = begun.place + turned(away, -(begun.heading or 0.0))
    grown = max(part.shape.size for part in parts_of(asked.problem.body))
    far = np.linalg.norm(away, axis=-1).max()
    grown += known.shifts(model.n_p).sum() + known.heading * far + drift
    widths = model.tube.interval[model.tube.bins_of(last.k[None])[0]].max(axis=0)
    for both, width in zip(pairwise(places), widths, strict=True):
        off = np.linalg.norm(width.reshape(model.n_points, -1), axis=1).max()
        if not MultiPoint(np.concatenate(both)).convex_hull.distance(region) > grown + off:
            return True
    return False


def turned(away: np.ndarray, heading: float) -> np.ndarray:
    """(..., n_p) from the world into a frame with this heading."""
    if not heading:
        return away
    cosine, sine = np.cos(heading), np.sin(heading)
    return away @ np.array([[cosine, -sine], [sine, cosine]])
