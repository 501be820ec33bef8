"""A policy of anybody's behind a loop: of each of its actions the nearest certified manoeuvre is
driven, whose stop is in hand. [T37, T38]
"""

import contextlib
import math
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from parc_jax.common.arrays import as_float64, at_least
from parc_jax.common.errors import InputError, SoundnessError, check_kind, reading
from parc_jax.common.on_use import package
from parc_jax.common.premises import assumptions
from parc_jax.drive.loop.candidates import Outlook, even_candidates, given_axes, listed_candidates
from parc_jax.drive.loop.commitment import Commitment, Step
from parc_jax.drive.loop.episode_file import save_episode
from parc_jax.drive.loop.loop import AT_ONCE, Effort, Loop
from parc_jax.learning.model import TrajectoryModel, check_model
from parc_jax.learning.system import System
from parc_jax.learning.systems.user_code import blamed, said
from parc_jax.problem.body import Body, Disc, Polygon
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.safe_set.verdict.outline import require_same

gymnasium = package("gymnasium", "Shield", "rl")

PATIENT = Effort(candidates=AT_ONCE, judged=AT_ONCE, looks=16 * AT_ONCE, deadline=math.inf)
ROUNDED_BY = 1e-6  # [of an action] what clip and dtype may change of it; more is not driven

Metric = Callable[[np.ndarray, np.ndarray], np.ndarray]


class Sensed(NamedTuple):
    """What is known at a step. pose, given, obstacles, spans, drift: as of `Loop.step`, whose clock
    counts from the last reset or restart. Noise of a pose is no drift, but `uncertainty`.
    """

    pose: ArrayLike
    given: ArrayLike
    obstacles: Sequence
    spans: Sequence | None = None
    drift: float = 0.0


class Shield(gymnasium.Wrapper):
    """A Gymnasium environment whose actions pass a certified shield: `env = pj.drive.Shield(env,
    model, ...)`, then any policy as before.

    An action proposes a manoeuvre: itself for `every` seconds, then the brake. Of this one and of
    `candidates` the nearest that is proved safe over all of its time, rest included, is driven for
    a step. One that is farther from the proposal than the brake already under way is left out, the
    more are let in the less of that is left, and where none is proved that brake continues: while
    each run is inside its tube and each pose within `uncertainty`, nothing that stands is touched
    that was sensed when the manoeuvre under way began, and nothing that moves until
    `certified_until`, whatever is proposed. [T38]

    model: its manoeuvres are an action for `every` seconds, then a brake to rest; k as of `Loop`.
    system: the black box that the environment drives; refused where it has another name, law or
        sizes than the model's.
    body: as of `reach_avoid`. every: [s] of one step of the environment.
    sense: (environment, observation) -> Sensed, before each step.
    ask: action -> chosen parameters (n_chosen,) of the manoeuvre that begins with it.
    act: (k (n_k,), seconds since its begin, given now) -> action of a manoeuvre, as in its runs.
    rest: chosen parameters of a stop, zeros by default: at each reset the nearest to it that is
        certified begins, and there must be one. Every manoeuvre ends in a stop.
    candidates (b, n_chosen): alternatives, at most 62; even over K by default.
    metric: (proposed (n_chosen,), candidates (b, n_chosen)) -> distances (b,); by default Euclidean
        in shares of the widths of K.
    room: [m] of clearance that is asked of a manoeuvre, or as much as the brake under way has where
        that is less; the longer it is under way, the less, and none once it has ended: a robot that
        stops too close finds nothing safe to begin. None is asked at the first step.
    assumed: what else its certificates rest on, as of `save_episode`. uncertainty, of what is
        sensed, and effort: as of `Loop`; no deadline by default, since a simulation waits.

    `info["shield"]` has `proposed` and `driven`, actions; `changed`, whether the manoeuvre driven
    is another than the proposed one; `certified_until` [s] since the last reset or restart, its
    `told_until`; `clearance` [m], the least on all of it, -inf once a tube was left, its own or one
    of a robot in its way; `reason`, why nothing new was committed to, else empty. What there is
    nothing to say of is not in it, as vector environments want it: `left`, once for each
    manoeuvre, True where the pose is outside of its tube, whatever it is off by, False where it was
    inside so until another took over, None where neither is known; `left_at_end`, the same where
    the episode ends, after a whole `every`. Both are NumPy's bools, which vector environments keep
    beside None, and of places at steps alone: between them, or by other goal states (q), a tube may
    be left unseen. `followed`, `followed_at_end`, the share of its time that either is about, which
    `Monitor.bet` takes too. `commitments`: of this episode. Raises InputError for arguments that do
    not belong together, and in `reset` where no stop is certified. An action that is none, or
    cannot be asked for or driven, and sensing that fails or leads out of the tube, end in the stop
    under way, with a sentence.
    """

    __passing__ = ("commitments", "_observation", "_last", "_steps", "_left")  # of an episode

    def __init__(
        self,
        env: Any,
        model: TrajectoryModel,
        *,
        system: System,
        body: Body | Disc | Polygon | float,
        every: float,
        sense: Callable[[Any, Any], Sensed],
        ask: Callable[[np.ndarray], ArrayLike],
        act: Callable[[np.ndarray, float, np.ndarray], ArrayLike],
        rest: ArrayLike | None = None,
        candidates: ArrayLike | None = None,
        metric: Metric | None = None,
        room: float = 0.0,
        uncertainty: Uncertainty | None = None,
        effort: Effort | None = None,
        assumed: Mapping[str, Any] | None = None,
    ):
        check_kind("Shield, environment of Gymnasium", env, gymnasium.Env)
        if env.has_wrapper_attr("autoreset"):  # that of Autoreset, under any other wrapper
            raise InputError(
                "Shield: expected an environment that waits for reset, where a stop is certified; "
                "one with Autoreset begins another world in a step. Leave that wrapper out."
            )
        check_model(model)
        require_same(system, model)
        super().__init__(env)
        given = given_axes(model, None)
        self._chosen = [axis for axis in range(model.n_k) if axis not in given]
        self._given = list(given)
        self._lo, self._hi = model.domain.lo[self._chosen], model.domain.hi[self._chosen]
        self._sense, self._ask, self._act = sense, ask, act
        self._metric = self._euclidean if metric is None else metric
        for call in (sense, ask, act, self._metric):
            check_kind("Shield: sense, ask, act and metric", call, Callable)
        assumptions("Shield", assumed)  # raises InputError
        n = len(self._chosen)
        rest = as_float64("rest", np.zeros(n) if rest is None else rest, (n,))
        if candidates is None:
            candidates = even_candidates(model, given, AT_ONCE - 2)[:, self._chosen]
        # the first row is what is proposed; the stop is always among the others
        candidates = as_float64("candidates", candidates, (None, n))
        rows = np.concatenate([[rest, rest], candidates])
        if len(rows) > AT_ONCE:
            raise InputError(
                f"Shield: expected at most {AT_ONCE - 2} candidates, which are judged in one call "
                f"with the proposal and the stop; got {len(rows) - 2}."
            )
        self._rows = listed_candidates(model, given, rows)
        self.loop = Loop(
            model,
            body,
            leave=every,
            given=given,
            uncertainty=uncertainty,
            candidates=rows,
            effort=PATIENT if effort is None else effort,
        )
        self._assumed = dict(assumed or {})
        self.every, self.room = every, at_least("room", room)
        self.commitments: list[Commitment] = []
        self._observation: Any = None
        self._last = self._rows[0, self._given]  # the last given parameters that were finite
        self._steps: int | None = None  # None until a reset has certified a stop
        self._left: bool | None = False  # the tube of the manoeuvre under way; as of `Step`
        self._require_actions(model.domain.lo, model.domain.hi, self._rows[0])

    def reset(self, **options: Any) -> tuple[Any, dict]:
        """Reset the environment, then as `restart`."""
        self._steps = None
        observation, info = self.env.reset(**options)
        return observation, info | self.restart(observation)

    def restart(self, observation: Any) -> dict:
        """Begin an episode in the environment as it is, without a reset of it: after a tube was
        left, or behind another model. Returns `info`, whose `shield` speaks of the certified stop.
        Raises InputError where there is none: the policy must not begin there.

        observation: the last one of the environment.
        """
        self._steps, self._left, self.commitments = None, False, []
        self.loop.restart()
        what = "to sense at reset"
        with reading("Shield", what, Exception), blamed(f"Shield: expected {what}"):
            seen = self._sensed(observation)
        with blamed("Shield: expected to decide at reset"):
            step = self._decide(seen, self._rows[0, self._chosen], 0.0)
        if step.committed is None:
            raise InputError(
                f"Shield: expected a certified stop where the environment is reset; {step.reason}. "
                "Reset again, or move the start away from the obstacles."
            )
        self.commitments.append(step.committed)
        self._steps, self._observation = 0, deepcopy(observation)
        self._remember(seen)
        return {"shield": {"changed": False, "reason": ""} | self._about(step.committed)}

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict]:
        """Drive the nearest certified manoeuvre for one step of the environment."""
        if self._steps is None:
            raise InputError("Shield: expected a reset that certified a stop before a step.")
        now = self._steps * self.every
        followed = self._followed(now)  # of the manoeuvre before, where another takes over
        decision, changed = self._step_of(action, now)
        one = decision.committed
        assert one is not None  # the stop of the reset at least
        driven = self._driven(one.k, now - float(one.begin))
        over = bool(decision.new and now)  # the manoeuvre before; each is told of once
        before, left = self._left, self._seen(decision.left)
        tells = {"left": left} if before is not True and (over or left) else {}
        self._left = False if over else left
        # an environment that raises may have moved on: without another reset nothing is certified
        steps, self._steps = self._steps, None
        observation, reward, terminated, truncated, info = self.env.step(driven.copy())
        why = decision.reason
        if terminated or truncated:
            at_end, unknown = self._left_at_end(observation, now + self.every)
            why = "; ".join(filter(None, [why, unknown]))
            tells |= {} if self._left else {"left_at_end": at_end}
        # of what comes after the end no stop was certified
        self._steps = None if terminated or truncated else steps + 1
        self._observation = deepcopy(observation)  # the policy may write into its own
        about = self._about(one) | {"driven": driven, "changed": changed, "reason": why}
        with contextlib.suppress(Exception):  # the policy may propose anything
            about["proposed"] = np.array(action)
        about |= {"followed": followed, "followed_at_end": self._followed(now + self.every)}
        about |= {at: x if x is None else np.bool_(x) for at, x in tells.items()}
        return observation, reward, terminated, truncated, info | {"shield": about}

    def certificate(self, path: str | Path, meta: dict | None = None) -> Path:
        """Write the episode since the last reset or restart, which `parc-jax check` verifies: every
        commitment, and that each began where the one before may have been left. meta: unchecked.
        """
        return save_episode(path, self.commitments, meta)

    def _step_of(self, action: Any, now: float) -> tuple[Step, bool]:
        """The decision of a step, and whether it is another than was proposed."""
        try:
            seen = self._sensed(self._observation)
        except Exception as error:  # the user's code may raise anything
            return self.loop.go_on(f"what is sensed is not known: {said(error)}"), True
        self._remember(seen)
        where, first = (seen.pose, now, seen.drift, seen.given), self.commitments[0]
        try:
            proposed = self._asked(action)
            if not self._steps:  # the time of the reset: its stop, or another in its place
                self.loop.restart()
            step = self._decide(seen, proposed, now)
        except Exception as error:
            if not self._steps:
                self.loop.restart(first)
            if isinstance(error, MemoryError | SoundnessError):
                raise
            why = str(error).rstrip(".") if isinstance(error, InputError) else said(error)
            return self.loop.go_on(why, None, *where), True
        if step.new:
            if not self._steps:
                self.commitments.clear()
            self.commitments.append(step.committed)
            return step, not np.array_equal(step.committed.k[self._chosen], proposed)
        if not self._steps:
            self.loop.restart(first)
            return self.loop.go_on(step.reason, None, *where), True
        return step, True

    def _left_at_end(self, observation: Any, now: float) -> tuple[bool | None, str]:
        """Was the tube under way left by the last pose? None where that is not known; why not."""
        try:
            seen = self._sensed(observation)
            step = self.loop.go_on("", None, seen.pose, now, seen.drift, seen.given)
        except Exception as error:  # of a world that ended nothing may be there to sense
            return self._seen(None), f"what is sensed at the end is not known: {said(error)}"
        left = self._seen(step.left)
        return left, "nobody knows whether the last tube was left" * (left is None)

    def _seen(self, left: bool | None) -> bool | None:
        """Of all looks at the manoeuvre under way: what one found, or left open, stays so."""
        return max(self._left, left, key=(False, None, True).index)

    def _followed(self, now: float) -> float:
        """Share of the manoeuvre under way, its stop included, that was driven by now."""
        so_far = (now - float(self.commitments[-1].begin)) / float(self.loop.lasts)
        return min(1.0, round(so_far, 9))

    def _decide(self, seen: Sensed, proposed: np.ndarray, now: float) -> Step:
        """One step of the loop, the proposal first, the others by their distance from it."""
        rows = self.loop.candidates = self._rows.copy()
        rows[0, self._chosen] = proposed
        last, ahead, least = self.loop.under_way, 0.0, 0.0
        if last is not None:  # share of the brake under way that is left
            ahead = 1.0 - self._followed(now)
            least = ahead * min(self.room, last.clearance)

        def prefer(outlook: Outlook) -> np.ndarray:
            far = np.asarray(self._metric(proposed, outlook.k[:, self._chosen]), np.float64)
            far[0] = 0.0
            # the brake under way is proved, too; the nearer its end, the less it is preferred, else
            # a robot that rests where the proposal is not safe stays there
            if last is not None and ahead > 0:
                brake = self._act(last.k, now - float(last.begin), self._last)
                its = np.asarray(self._metric(proposed, np.asarray(self._ask(brake))[None]))
                far[1:][~(far[1:] * ahead < its[0])] = np.inf
            return far

        more = {"spans": seen.spans, "drift": seen.drift, "least": least}
        try:  # explained at first alone: it takes 50 ms, in a step of 3
            step = self.loop.step(*seen[:3], prefer, now, explain=last is None, **more)
        finally:
            self.loop.candidates = self._rows  # no part of what the shield is made from
        if step.committed is not None:
            step.committed.episode.assumed = self._assumed
        return step

    def _sensed(self, observation: Any) -> Sensed:
        return Sensed(*self._sense(self.env, observation))

    def _remember(self, seen: Sensed) -> None:
        """What the brake needs; what is not finite does not replace what was."""
        with contextlib.suppress(InputError):
            self._last = as_float64("given", seen.given, self._last.shape)

    def _asked(self, action: Any) -> np.ndarray:
        """Chosen parameters of an action. Raises InputError."""
        action = as_float64("action", action, self.action_space.shape)
        proposed = as_float64("ask", self._ask(action), self._lo.shape)
        if not ((self._lo <= proposed) & (proposed <= self._hi)).all():
            raise InputError(
                "ask: expected chosen parameters within K for the action "
                f"{action.tolist()!r:.60}; got {proposed.tolist()!r:.60}"
            )
        k = self._rows[0].copy()
        k[self._chosen] = proposed
        self._driven(k, 0.0)
        return proposed

    def _euclidean(self, proposed: np.ndarray, candidates: np.ndarray) -> np.ndarray:
        return np.linalg.norm((candidates - proposed) / (self._hi - self._lo), axis=1)

    def _about(self, one: Commitment) -> dict:
        if one.seen_outside or one.others_left:  # what was proved is of another run
            until = (*one.seen_outside, one.begin)[0]
            return {"certified_until": float(until), "clearance": -np.inf}
        return {"certified_until": float(one.told_until), "clearance": one.clearance}

    def _require_actions(self, *ends: np.ndarray) -> None:
        """Raises InputError where actions and manoeuvres of each other are not."""
        space = self.action_space
        check_kind("Shield: action space", space, gymnasium.spaces.Box)
        if space.dtype not in (np.float32, np.float64):  # else what is driven is not what is proved
            raise InputError(f"Shield: expected actions of float32 or float64; got {space.dtype}.")
        for corner in (space.low, space.high):
            with reading("Shield: ask", f"to take actions of shape {space.shape}", Exception):
                self._asked(corner)
        for end, k, seconds in product(ends, self._rows, (0.0, 1.0)):
            self._last = end[self._given]  # a stop may begin at the greatest speeds
            self._driven(k, seconds)

    def _driven(self, k: np.ndarray, seconds: float) -> np.ndarray:
        """The action of a manoeuvre. Raises InputError."""
        space = self.action_space
        with blamed("act: expected the action of a manoeuvre"):
            action = as_float64("act", self._act(k, seconds, self._last), space.shape)
        driven = action.clip(space.low, space.high).astype(space.dtype)
        if not np.allclose(driven, action, ROUNDED_BY):
            raise InputError(f"act: expected an action within {space}; got {action.tolist()!r:.60}")
        return driven
