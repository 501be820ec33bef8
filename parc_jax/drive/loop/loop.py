"""The loop that never stops being safe: every step commits to a new manoeuvre that is proved over
all of its time, rest included, or continues the one under way, which was. [T37, T38, T39]
"""

import contextlib
import math
import time
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from parc_jax.answer.why import why_of
from parc_jax.common.arrays import NO_NUMBER, as_float64, at_least, real
from parc_jax.common.errors import InputError, check_count, check_kind, shown
from parc_jax.common.probes import require_sound_arithmetic
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.spelling import exact
from parc_jax.drive.loop import candidates as listed
from parc_jax.drive.loop.commitment import Begun, Commitment, LeftTube, Step, leads_to, outside_tube
from parc_jax.drive.loop.scenes import Scenes
from parc_jax.learning.labels import name_of
from parc_jax.learning.model import TrajectoryModel, check_model
from parc_jax.learning.system import LARGEST
from parc_jax.problem.body import Body, Disc, Polygon
from parc_jax.problem.robust.pose import Pose, pose_of
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.safe_set.corridors.first import preferred

if TYPE_CHECKING:
    import shapely

    from parc_jax.problem.world.free_space import FreeSpace

AT_ONCE = 64  # candidates judged in one compiled call, between readings of the clock
SHORTEST = 1e-9  # [s] deadline
SAME_MOMENT = 1e-6  # [s] by which a measurement may be told later than the clock: rounding of it
AMONG = 6  # safe ones of a call, of which one with enough clearance is taken

Prefer = Callable[[listed.Outlook], np.ndarray]


@dataclass(frozen=True)
class Effort:
    """The work of one step of a loop.

    candidates: drawn once, evenly over the chosen parameters. judged: most of these per step, the
    best first. looks: most tests of a pair of an obstacle and a part, which are nearly all of the
    work; no further candidate is judged after as many. room: [m] preferred clearance: of the first
    few safe candidates the cheapest with as much is taken, else the one with most.
    deadline: [s] of the clock for a step; nothing is committed to after it.
    """

    candidates: int = 1024
    judged: int = 256
    looks: int = 1024
    room: float = 0.0
    deadline: float = 0.1

    def __post_init__(self):
        for name in ("candidates", "judged", "looks"):
            check_count(f"Effort: {name}", getattr(self, name), 1, "1024")
        for name, lowest in (("room", 0.0), ("deadline", SHORTEST)):  # either may be infinite
            check_kind(f"Effort: {name}", value := getattr(self, name), Real)
            at_least(f"Effort: {name}", min(value, LARGEST), lowest)


class Loop:
    """A robot that drives by one model. Made once, which compiles; `step` is called repeatedly.

    model: its manoeuvres contain their stop: at the end of each the robot rests, and stays.
    body: as of `reach_avoid`. leave: [s] from the start of a manoeuvre to the first moment at which
    the next one may begin. given: parameters of k measured at the start, names or indices; by
    default those that the system declares, the only choice where the claim rests on runs. Without
    any it is assumed that each manoeuvre begins as the runs did, at rest where they did.
    uncertainty: of start, heading and obstacles, equal at every step. end: set of admissible ends,
    over all points and q seen from the start with the measured heading, for every heading in its
    uncertainty; None for all. candidates (b, chosen parameters): to judge at every step; by default
    `effort.candidates`, even over K. thinking: every run of the model waits for the next command;
    None where that begins at the moment of measuring, as in a simulation. clock: [s] from which
    deadlines count, `time.perf_counter` by default; one that stands still where a simulation waits.
    Raises InputError for arguments that do not fit the model, for one that does not rest at its end
    (`require_rest`), and for a time to leave at which no run of its claim was left.

    A pose outside of the tube of the manoeuvre under way, by more than its uncertainty and drift,
    begins nothing: a tube was left, a command came late, or the pose is wrong. The manoeuvre
    continues to its stop, with a sentence by how far, until `restart` begins another episode.
    """

    __passing__ = ("_episode", "_last", "under_way", "_before")  # of an episode, not of the loop

    def __init__(
        self,
        model: TrajectoryModel,
        body: Body | Disc | Polygon | float,
        *,
        leave: float,
        given: Sequence[str | int] | None = None,
        uncertainty: Uncertainty | None = None,
        end: HPolytope | None = None,
        candidates: np.ndarray | None = None,
        effort: Effort | None = None,
        thinking: listed.Thinking | None = None,
        clock: Callable[[], float] | None = None,
    ):
        check_model(model)
        kinds = {"uncertainty": (uncertainty, Uncertainty), "end": (end, HPolytope)}
        kinds |= {"effort": (effort, Effort), "thinking": (thinking, listed.Thinking)}
        for name, (value, kind) in (kinds | {"clock": (clock, Callable)}).items():
            if value is not None and not isinstance(value, kind):
                raise InputError(f"{name}: expected {kind.__name__} or None; got {value!r:.60}.")
        require_sound_arithmetic()
        self.model, self._clock = model, clock or time.perf_counter
        self.uncertainty = Uncertainty() if uncertainty is None else uncertainty
        self.effort = Effort() if effort is None else effort
        self.given = listed.given_axes(model, given)
        self._scenes = Scenes(model, body, end, self.uncertainty)
        self._leaving = listed.leaving("leave", model, leave)
        self.lasts, self.leave_after = self._leaving.lasts, self._leaving.first
        self._command = None
        if thinking is not None:
            self._command = listed.UnderWay(thinking, model, self.given)
            seconds, left = float(self._command.seconds), float(self.leave_after)
            # else a step could end, or the next one begin, before its command
            if not self.effort.deadline <= seconds <= left:
                raise InputError(
                    f"Loop: expected a deadline within the {exact(seconds)} s of thinking, and a "
                    f"time to leave no earlier; got {exact(self.effort.deadline)} s and "
                    f"{exact(left)} s."
                )
        self.candidates = listed.even_candidates(model, self.given, self.effort.candidates)
        if candidates is not None:
            self.candidates = listed.listed_candidates(model, self.given, candidates)
        listed.require_rest(model, self.candidates, self.given)
        self._episode: Any = Begun()
        self._last: Commitment | None = None  # that began
        self.restart()
        # compile everything that a step may need
        pose = np.zeros(model.n_p + (model.rotation is not None))
        scene = self._scenes.scene(pose_of(pose, model), ())
        k = self._all_of_k(model.domain.lo[list(self.given)])
        preferred(scene, k[np.zeros(AT_ONCE, int)], AMONG, self.effort.room)
        why_of(scene, listed=k[:1])

    def step(
        self,
        pose: ArrayLike,
        given: ArrayLike,
        obstacles: Sequence,
        prefer: Prefer,
        at: float | None = None,
        measured: float | None = None,
        spans: Sequence | None = None,
        drift: float = 0.0,
        gone: "FreeSpace | shapely.Geometry | None" = None,
        least: float = 0.0,
        explain: bool = True,
        goal: HPolytope | None = None,
    ) -> Step:
        """Commit to the cheapest manoeuvre that is proved safe, or continue the one under way.

        pose: measured, as of `Planner.solve`. given: values of the given parameters, in their
        order, without those of `thinking`. obstacles: boxes or polytopes in the world to avoid in
        the new one. prefer: maps an Outlook of b candidates to costs (b,); NaN and infinite ones
        are left out. at: [s] of the loop's clock at which the pose was measured; None for the first
        moment at which the manoeuvre under way may be left; nothing begins earlier. measured: the
        reading of `clock` at that moment, from which the deadline counts; None for now. spans: of
        each obstacle the intervals in which it exists, made for this moment: a Span with `at`, as
        of `moving`, all of whose parts are needed; None for always. After the manoeuvre's rest
        nothing is claimed of them: they may run into a robot that rests [T38]. drift: [m] by which
        the pose may be off against that at which the manoeuvre under way began, beside the
        uncertainty of both; obstacles and goal are told in the drifted frame: see them anew. gone:
        a FreeSpace, or its `gone`, for the sentence. least: [m] of clearance without which nothing
        is committed to. explain: say what the nearest candidate lacks where none is safe, which
        takes longer than the verdicts. goal: set in the world in which this manoeuvre is proved to
        end, as of `reach_avoid`, in place of `end`; its heading is counted on from that of the
        pose, which is within half a turn of 0. Wrong measurements end in the manoeuvre under way,
        with a sentence. Raises InputError: gone, least, prefer.
        """
        begin, stop = self._clock(), partial(self.go_on, gone=_region(gone), drift=drift)
        if not (isinstance(least, float) and math.isinf(least)):  # for any, or for none
            least = float(as_float64("least", least, ()))
        if not callable(prefer):
            raise InputError(f"prefer: expected a function of an Outlook; got {prefer!r:.60}.")
        try:
            if measured is not None:
                own, begin = begin, float(as_float64("measured", measured, ()))
                if begin > own + SAME_MOMENT:  # no deadline would count from there
                    got = f"at {own:.15g} s; got {begin:.15g} s."
                    raise InputError(f"measured: expected the loop's own clock, {got}")
            now, here = self._time(at, begins=True), self._here(pose)
            k = self._all_of_k(self._with_command(given, now))
            left = self._require_inside(here, now, k[0], drift)
            drifted = float(drift) + (0.0 if self.under_way is None else self.under_way.drifted)
            scene = self._scenes.scene(here, obstacles, spans, goal, now, drifted)
        except LeftTube as error:
            return replace(stop(str(error).rstrip(".")), left=True)
        except InputError as error:
            return stop(str(error).rstrip("."), pose=pose, at=at, given=given)
        k.setflags(write=False)  # `prefer` sees what is measured, and what is committed to
        said = prefer(listed.outlook(self.model, here, k, self._leaving.intervals))
        try:
            cost = np.asarray(real(said), float)
        except NO_NUMBER:
            raise InputError(f"prefer: expected {len(k)} numbers; got {shown(said)}.") from None
        if cost.shape != (len(k),):
            raise InputError(f"prefer: expected {len(k)} numbers; got shape {cost.shape}.")
        order = np.argsort(cost, kind="stable")
        order = order[np.isfinite(cost[order])]
        most = min(len(order), self.effort.judged)
        judged = looks = 0
        room = max(self.effort.room, least)
        while judged < most and looks < self.effort.looks:
            rows = order[judged : min(judged + AT_ONCE, most)]
            # a short call repeats its last candidate: one shape, one compiled program
            rows = rows[np.minimum(np.arange(AT_ONCE), len(rows) - 1)]
            safe = preferred(scene, k[rows], AMONG, room, self.effort.looks - looks)
            judged, looks = min(judged + safe.judged, most), looks + safe.looks
            # read after the verdicts: a manoeuvre that was proved too late begins too late
            if self._clock() - begin > self.effort.deadline:
                late = f"no manoeuvre was proved within {self.effort.deadline:g} s, effort.deadline"
                late += f"; {judged:,} of {len(order):,} candidates were looked at"
                return replace(stop(late), left=left)
            i = int(np.argmax(np.minimum(safe.clearance, room))) if len(safe.rows) else -1
            if i >= 0 and safe.clearance[i] >= least:
                chosen, clear = k[rows[safe.rows[i]]], float(safe.clearance[i])
                about = clear, judged, scene.nominal, float(drift), drifted
                number = 0 if self.under_way is None else self.under_way.number + 1
                told = {"episode": self._episode, "given": self.given}
                told |= {} if self._command is None else {"command": self._command.words}
                one = Commitment(number, now, now + self.lasts, chosen, *about, **told)
                self._before, self.under_way, self._last = self.under_way, one, one
                self._episode[:] = [one]
                self._episode.begins += (now,)
                return Step(one, True, left=left)
        more = ""
        if judged < len(order):
            which = "looks" if judged < most else "judged"
            more = (
                f"; {len(order) - judged:,} of {len(order):,} were not looked at, which takes more "
                f"than {getattr(self.effort, which):,} as effort.{which}"
            )
        if len(order) < len(k):
            more += f"; {len(k) - len(order):,} were left out by prefer"
        if least:
            more = f" with {exact(least)} m of clearance{more}"
        why = self._scenes.why_none(scene, k, k[order[:judged]]) if explain else ""
        return replace(stop(f"none of {judged:,} candidates is safe{more}{why}"), left=left)

    def another(self) -> "Loop":
        """A loop for another robot of the same kind, at rest; what was compiled serves both."""
        made = copy(self)
        made._episode, made._last = Begun(), None
        made.restart()
        return made

    def restart(self, first: Commitment | None = None) -> None:
        """Another episode: the robot rests, at a place where it touches nothing; or begins with
        the manoeuvre `first`. Raises InputError unless that is the last that this loop began.
        """
        if first not in (None, self._last):
            raise InputError(f"restart: expected what this loop began last; got {first!r}.")
        self._episode.clear()  # what it had under way is so no more
        self.under_way, self._before = first, None
        self._episode, begun = (first.episode, [first]) if first else (Begun(), [])
        self._episode[:], self._episode.begins = begun, tuple(one.begin for one in begun)

    def go_on(
        self,
        reason: str,
        gone: "FreeSpace | shapely.Geometry | None" = None,
        pose: ArrayLike | None = None,
        at: float | None = None,
        drift: float = 0.0,
        given: ArrayLike | None = None,
    ) -> Step:
        """Continue the manoeuvre under way to its stop, for a reason of the caller: an invalid
        scan, a place without free space. gone: as of `step`; the sentence says whether the
        manoeuvre may lead there. pose, at, drift, given: as of `step`, where they are known; what
        is outside the tube is said first, without given of the first reference point alone. Raises
        InputError for a wrong gone.
        """
        (outside, left), gone = self._left(pose, at, drift, given), _region(gone)
        last, off = self.under_way, math.inf  # of a drift that is not known it may lead anywhere
        reason = "; ".join(filter(None, [outside, last and last.others_left, reason]))
        with contextlib.suppress(InputError):
            off = at_least("drift", drift)
        if last is not None and gone is not None and leads_to(last, gone, off):
            reason += "; the manoeuvre under way may lead where it is no longer known to be free"
        return Step(last, False, reason, left)

    def _left(self, pose: Any, at: float | None, drift: float, given: Any):
        """Why a pose is not of the manoeuvre under way, else empty; whether, as of `Step`."""
        k = None
        try:
            here, now = self._here(pose), self._time(at)
            with contextlib.suppress(InputError):  # else of the first reference point alone
                k = self._all_of_k(self._with_command(given, now))[0]
            return "", self._require_inside(here, now, k, drift)
        except InputError as error:
            left = isinstance(error, LeftTube)
            return (str(error).rstrip("."), True) if left else ("", None)

    def _here(self, pose: ArrayLike) -> Pose:
        here = pose_of(pose, self.model)
        if here.heading is None:
            return here
        # certificates take no more than a turn
        return here._replace(heading=math.remainder(here.heading, 2 * math.pi))

    def _time(self, at: float | None, begins: bool = False) -> Fraction:
        """[s], exact, after what is under way began. begins: another may. Raises InputError."""
        last = self.under_way
        if at is None:
            return Fraction(0) if last is None else last.begin + self.leave_after
        now = Fraction(float(as_float64("at", at, ())))
        if last is not None and (now <= last.begin if begins else now < last.begin):
            raise InputError(
                f"at: expected a time after {exact(last.begin)} s, when the manoeuvre under way "
                f"began; got {exact(now)} s. Another episode begins with `restart`."
            )
        if last is not None and begins:
            self._leaving.require(now - last.begin, "at")
        return now

    def _with_command(self, given: ArrayLike, at: Fraction):
        """All given parameters: as measured, or the command under way. [T39] Raises InputError."""
        command = self._command
        if command is None:
            return given
        measured = [axis for axis in self.given if axis not in command.axes]
        values = np.zeros(self.model.n_k)
        values[measured] = as_float64("given", given, (len(measured),))
        values[command.axes] = command.command(self.under_way, at)
        return values[list(self.given)]

    def _require_inside(self, pose: Pose, at: Fraction, k: np.ndarray | None, drift: float):
        """As of `Step.left`; raises LeftTube for a pose beyond. k: as of `outside_tube`. [T38]"""
        last = self.under_way
        drift = at_least("drift", drift)
        if last is None:
            return False
        if last.seen_outside:
            raise LeftTube(
                f"at: by {exact(last.seen_outside[0])} s a pose was beyond what tube, "
                "uncertainty and drift of the manoeuvre under way allow. At rest, begin again with "
                "`restart`."
            )
        outside, most = outside_tube(last, pose, at, k)
        if outside <= drift:
            return False if most + drift <= 0 else None
        last.seen_outside.append(at)
        self._episode.outside += (at,)
        late, before = "", self._before
        earlier = (last, pose, last.begin) if before is None else (before, pose, at)
        # inside of the tube before: the robot does not follow the last command yet
        if outside_tube(*earlier, k)[0] <= drift:
            late = ", and where it would be had the last command come late or never: see thinking"
        raise LeftTube(
            f"at: expected a pose to which the manoeuvre under way may have led by {exact(at)} "
            f"s; this one is {outside - drift:.3g} m beyond what tube, uncertainty and drift allow"
            f"{late}. At rest, begin again with `restart`."
        )

    def _all_of_k(self, given: ArrayLike) -> np.ndarray:
        """(b, n_k) all candidates with measured values. Raises InputError."""
        values = as_float64("given", given, (len(self.given),))
        lo, hi = (side[list(self.given)] for side in (self.model.domain.lo, self.model.domain.hi))
        outside = ~((lo <= values) & (values <= hi))
        if outside.any():
            i = int(np.argmax(outside))
            name = name_of(self.model.labels.k[self.given[i]])
            raise InputError(
                f"given: expected {name} within K, {exact(lo[i])} to {exact(hi[i])}; got "
                f"{exact(values[i])}."
            )
        k = self.candidates.copy()
        k[:, list(self.given)] = values
        return k


def _region(gone: Any) -> "shapely.Geometry | None":
    """What is gone of a free space. Raises InputError at once, not when a loop has to stop."""
    gone = getattr(gone, "gone", gone)
    if gone is not None and not hasattr(gone, "is_empty"):
        raise InputError(f"gone: expected a FreeSpace, or its `gone`; got {gone!r:.60}.")
    return gone
