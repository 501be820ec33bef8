"""The shield for batches of functional environments: pure functions of arrays, for a jitted step of
thousands of them. [T37, T38]
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.drive.loop import candidates as listed
from parc_jax.drive.loop.commitment import ROUNDED
from parc_jax.drive.loop.scenes import Scenes
from parc_jax.learning.bound.bins import open_bin_of
from parc_jax.learning.model import TrajectoryModel, check_model, float_slack
from parc_jax.learning.network.predict import predict
from parc_jax.learning.system import System
from parc_jax.problem.body import Disc
from parc_jax.problem.robust.pose import pose_of
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.safe_set.separation.pairs import Obstacles
from parc_jax.safe_set.verdict.outline import require_same
from parc_jax.safe_set.verdict.rounds import Judge, Limits, Proposals, no_plans
from parc_jax.safe_set.verdict.scene import CORNERS, SceneArrays


class UnderWay(NamedTuple):
    """The manoeuvre under way in each environment: k (b, n_k), the pose (b, 2 or 3) where it began,
    steps (b,) ago, its clearance (b,) [m], given (b, n_given) as measured last and finite.
    certified (b,) bool: there is one; where not, that environment must be reset again.
    """

    k: jax.Array
    pose: jax.Array
    steps: jax.Array
    clearance: jax.Array
    given: jax.Array
    certified: jax.Array


class Driven(NamedTuple):
    """The decision of a step: action (b, m) to be driven; changed (b,) bool, another manoeuvre than
    was proposed; reason (b,): 0 where a new one was committed to, 1 for an action that is not
    finite or asks for a manoeuvre outside of K, 2 for a measurement that is not finite or is
    outside of K, or an obstacle beyond `far`, 3 for a pose outside of the tube, 4 where none is
    safe.
    """

    action: jax.Array
    changed: jax.Array
    reason: jax.Array


class BatchShield:
    """`Shield` for batches of functional environments, as Brax and MJX have them: `start` after a
    reset and `step` before each step are pure functions, so that a loop of both is one jitted call.
    It decides as `Shield` does, by the same verdicts, without certificates. [T38]

    model, system, every, room: as of `Shield`; candidates and rest as by default there. radius: [m]
        of the robot, a disc.
    ask, act: as of `Shield`, of one environment, in JAX; seconds are traced.
    far: [m] the farthest corner of an obstacle from the robot, along an axis; beyond, none begins.
    All of it is float64: refused where `jax.enable_x64` does not hold. Raises InputError, also for
    a model of several points.
    """

    def __init__(
        self,
        model: TrajectoryModel,
        *,
        system: System,
        radius: float,
        every: float,
        ask: Callable[[jax.Array], jax.Array],
        act: Callable[[jax.Array, jax.Array, jax.Array], jax.Array],
        room: float = 0.0,
        far: float = 100.0,
    ):
        check_model(model)
        require_same(system, model)
        if model.n_c != 2:
            raise InputError("BatchShield: expected a model of one reference point in the plane.")
        self._model, self._ask, self._act, self._every = model, ask, act, every
        given = listed.given_axes(model, None)
        chosen = [axis for axis in range(model.n_k) if axis not in given]
        self._given, self._chosen = np.array(given, int), np.array(chosen)
        even = listed.even_candidates(model, given, listed.AT_ONCE - 2)[:, chosen]
        rows = np.pad(even, ((2, 0), (0, 0)))  # first a stop: in the place of what is proposed
        self._rows = listed.listed_candidates(model, given, rows)
        listed.require_rest(model, self._rows, given)
        self._room, self._far, self._radius = as_float64("numbers", [room, far, radius], (3,))
        # seen from the robot: a goal that holds every end, no obstacle yet
        here = pose_of(np.zeros(2 + (model.rotation is not None)), model)
        scenes = Scenes(model, Disc(float(self._radius)), None, Uncertainty())
        scene = scenes.scene(here, ())
        size = np.abs(scene.z_hi).max() + CORNERS * (far + self._radius + ROUNDED)
        self._empty = scene.arrays.replace(slack=np.float64(float_slack(model, size)))

    def start(self, pose: Any, given: Any, corners: Any, active: Any) -> UnderWay:
        """Certify a stop in each environment. Arguments as of `step`."""
        rest = jnp.asarray(self._rows[0])

        def one(now: tuple):
            pose, given = now[:2]
            zero = jnp.zeros(())
            none = UnderWay(rest, pose, zero, zero, given, zero > 0)
            new, _, reason = self._decide(none, *now, rest[self._chosen])
            return new._replace(certified=reason == 0)

        return _each(one, pose, given, corners, active)

    def step(
        self, under_way: UnderWay, pose: Any, given: Any, corners: Any, active: Any, action: Any
    ) -> tuple[UnderWay, Driven]:
        """The nearest certified manoeuvre of each environment, or the one under way.

        pose (b, 2 or 3), given (b, n_given): measured now. corners (b, o, v, 2) [m] of convex
        obstacles in the world, one repeated where there are fewer; active (b, o) bool.
        action (b, m): proposed by the policy.
        """

        def one(now: tuple):
            *seen, action = now
            proposed = jnp.where(jnp.isfinite(action).all(), self._ask(action), jnp.nan)
            new, changed, reason = self._decide(*seen, proposed)
            driven = self._act(new.k, new.steps * self._every, new.given)
            return new._replace(steps=new.steps + 1), Driven(driven, changed, reason)

        return _each(one, under_way, pose, given, corners, active, action)

    def _decide(self, last: UnderWay, pose, given, corners, active, proposed):
        """The manoeuvre under way from now on, whether another than the proposed one, a reason."""
        model, chosen, axes = self._model, self._chosen, self._given
        lo, hi = jnp.asarray(model.domain.lo), jnp.asarray(model.domain.hi)
        last = last._replace(given=jnp.where(jnp.isfinite(given).all(), given, last.given))
        seconds, fresh = last.steps * self._every, last.steps == 0  # a stop may be replaced at once
        scene, near = self._scene(pose, corners, active)
        asked = ((lo[chosen] <= proposed) & (proposed <= hi[chosen])).all()
        seen = ((lo[axes] <= given) & (given <= hi[axes])).all() & near
        inside = fresh | (self._outside(last, pose, seconds) <= 0)
        k = jnp.asarray(self._rows).at[0, chosen].set(proposed).at[:, axes].set(given[None])

        def distance(k):
            return jnp.linalg.norm((k - proposed[None]) / (hi - lo)[None, chosen], axis=1)

        # as of `Shield`: what is nearer than the brake under way, with enough room
        ahead = jnp.where(fresh, 0.0, jnp.maximum(0.0, 1.0 - seconds / model.time.t_f))
        least = ahead * jnp.minimum(self._room, last.clearance)
        brake = distance(self._ask(self._act(last.k, seconds, last.given))[None])
        far = distance(k[:, chosen]).at[0].set(0.0)
        far = far.at[1:].set(jnp.where((ahead > 0) & ~(far[1:] * ahead < brake), jnp.inf, far[1:]))
        order = jnp.argsort(far)
        k, worth = k[order], jnp.isfinite(far[order]) & asked & seen & inside
        bins = jax.vmap(open_bin_of, (None, 0))(model.tube.edges, k)[:, None]
        plans = Proposals(jnp.zeros((len(k), 2)), k, bins, 1, worth)
        judge = Judge(model.net, model.tube, scene)
        # ends with the first that has enough
        safe = judge.in_turn(plans, no_plans(scene, len(k)), Limits(len(k), least))
        i = jnp.maximum(safe.count - 1, 0)
        clear = safe.clearance[i]
        good = (safe.count > 0) & (clear > 0) & (clear >= least)
        new = UnderWay(safe.plans[i, 2:], pose, 0 * seconds, clear, given, last.certified)
        new = jax.tree.map(lambda one, other: jnp.where(good, one, other), new, last)
        reason = jnp.select([good, ~asked, ~seen, ~inside], [0, 1, 2, 3], 4)
        return new, ~(good & (new.k[chosen] == proposed).all()), reason

    def _scene(self, pose, corners, active) -> tuple[SceneArrays, jax.Array]:
        """The obstacles as seen from the robot, and whether all are near enough."""
        away, n = _turned(corners - pose[None, None, :2], pose), len(active)
        near = (jnp.abs(away) <= self._far).all(axis=(1, 2)) | ~active
        pairs = Obstacles(
            vertices=jnp.where(active[:, None, None], away, 0.0),
            signs=jnp.zeros((n, 0, 2)),
            radius=jnp.full(n, self._radius + ROUNDED),
            points=jnp.zeros((n, 1), jnp.int32),
            active=jnp.broadcast_to(active[:, None], (n, self._model.time.n_steps)),
        )
        return self._empty.replace(obstacles=pairs, count=jnp.int32(n)), near.all()

    def _outside(self, last: UnderWay, pose, seconds) -> jax.Array:
        """[m] of the pose beyond the tube of the manoeuvre under way, as of `outside_tube`."""
        tube, time = self._model.tube, self._model.time
        knots = predict(self._model.net, tube.layout, last.k)[0]
        passed = jnp.minimum(seconds / time.dt, time.n_steps)
        before = jnp.minimum(passed.astype(int), time.n_steps - 1)
        way = knots[before] + (passed - before.astype(float)) * (knots[before + 1] - knots[before])
        allowed = jnp.asarray(tube.interval)[open_bin_of(tube.edges, last.k), before] + ROUNDED
        return (jnp.abs(_turned(pose[:2] - last.pose[:2], last.pose) - way) - allowed).max()


def _each(one: Callable, *of: Any):
    """One after another: the search of each ends by itself. Raises InputError."""
    if not jax.config.jax_enable_x64:
        raise InputError("BatchShield: expected float64; use it within `jax.enable_x64(True)`.")
    return jax.lax.map(one, jax.tree.map(jnp.asarray, of))


def _turned(away, pose):
    """From the world into the frame of a pose."""
    if len(pose) == 2:
        return away
    cosine, sine = jnp.cos(pose[2]), jnp.sin(pose[2])
    return away @ jnp.array([[cosine, -sine], [sine, cosine]])
