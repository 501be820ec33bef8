"""The shield for batches of environments: pure functions of arrays, to be jitted. [T37, T38]"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common import struct
from parc_jax.common.arrays import at_least, least, single
from parc_jax.common.backend import backend, while_open
from parc_jax.common.errors import InputError, reading
from parc_jax.drive.loop import candidates as listed
from parc_jax.drive.loop.commitment import ROUNDED, SAME
from parc_jax.drive.loop.scenes import Scenes
from parc_jax.learning.bound.bins import open_bin_of
from parc_jax.learning.bound.error_set import ErrorBox
from parc_jax.learning.model import TrajectoryModel, check_model, float_slack
from parc_jax.learning.network.predict import predict
from parc_jax.learning.system import System
from parc_jax.learning.systems.content import whole_digest
from parc_jax.problem.body import Disc
from parc_jax.problem.robust.pose import pose_of
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.safe_set.separation import segment
from parc_jax.safe_set.separation.pairs import Obstacles
from parc_jax.safe_set.verdict.outline import require_same
from parc_jax.safe_set.verdict.pointwise import prediction
from parc_jax.safe_set.verdict.scene import CORNERS, SceneArrays

AT_ONCE = 32, 8  # environments of which alternatives are looked at in one round, and of the last
TOGETHER = 8  # ones; a GPU takes all, and of each so many alternatives
NEAREST = 2  # obstacles whose gaps have a direction for each interval, not boxes alone
RANKED, EVERY, FAN = 4, 2, 128  # what ranking looks at: nearest obstacles, of knots, directions
SEEN = 1e-3  # [m] by which ranking may take a clearance for too small
TINY = 1e-12  # [m], [m^2] a part of a way that is shorter is none: no division by zero


@struct.dataclass
class UnderWay:
    """The manoeuvre under way in each environment: k (b, n_k), the pose (b, 2 or 3) where it began,
    steps (b,) ago, its clearance (b,) [m] at least, given (b, n_given) as measured last and finite.
    certified (b,) bool: there is one, whatever poses since say, as `Driven.reason` 3 does; where
    not, that environment must be reset again. left (b,) bool: a pose was outside of its tube, after
    which nothing begins, as of `Shield`. shield: the content of the one that has it under way.
    """

    k: jax.Array
    pose: jax.Array
    steps: jax.Array
    clearance: jax.Array
    given: jax.Array
    certified: jax.Array
    left: jax.Array
    shield: str = struct.field(pytree_node=False)


class Seen(NamedTuple):
    """What is measured, as of `BatchShield.step`."""

    pose: jax.Array
    given: jax.Array
    corners: jax.Array
    active: jax.Array


class Asked(NamedTuple):
    """Of what may take over: proposed (n_chosen,); ahead, the share of the brake under way that is
    left; brake (n_chosen,), what it does now; least [m] of clearance.
    """

    proposed: jax.Array
    ahead: jax.Array
    brake: jax.Array
    least: jax.Array


class Driven(NamedTuple):
    """The decision of a step: action (b, m) to be driven; changed (b,) bool, another manoeuvre than
    was proposed; reason (b,): 0 where a new one was committed to, 1 for an action that is not
    finite or asks for a manoeuvre outside of K, 2 for a measurement that is not finite or is
    outside of K, or an obstacle beyond `far`, 3 for a pose outside of the tube, 4 where none is
    safe, 5 at a time at which the manoeuvre under way may not be left, as of `Loop`.
    """

    action: jax.Array
    changed: jax.Array
    reason: jax.Array


class BatchShield:
    """`Shield` for batches of functional environments, as Brax and MJX have them: `start` after a
    reset and `step` before each step are pure functions, so that a loop of both is one jitted call.
    It decides as a `Shield` without `uncertainty`, and has no certificates. It knows a lower bound
    of a clearance, since its directions are not searched for: near the least that is asked it may
    be warier; and no k on an edge between bins is safe to it. [T14, T28, T38] A step tests the pose
    before it: the last one of an episode is tested by one more, of which nothing is driven, and
    `UnderWay.left` says the result where that is finite; else of the last tube nothing is known.
    It is False, too, where a pose is in the interval's tube but not in the narrower one of records
    or of the end: whether that was left nobody knows.

    model, system, every, room: as of `Shield`, candidates and rest by default. radius: [m], a disc.
    ask, act: as of `Shield`, of one environment, in JAX; seconds are traced.
    far: [m] the farthest corner of an obstacle from the robot, along an axis; beyond, none begins.
    All is computed in float64: refused where `jax.enable_x64` does not hold. Raises InputError,
    also for a model of several points, and for `every` at which no run of its claim was left.
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
        if any((edge[1:-1] == 0).any() for edge in model.tube.edges):
            raise InputError(
                "BatchShield: expected a model without an edge between bins at 0, where two of "
                "them hold and a robot that stands begins; use Shield, or other bins."
            )
        self._model, self._every = model, every
        self._ask, self._act = lambda *x: _real("ask", ask(*x)), lambda *x: _real("act", act(*x))
        self._content = whole_digest([model, radius, every, room, far, ask, act])
        self._leaving = listed.leaving("every", model, every)
        given = listed.given_axes(model, None)
        chosen = [axis for axis in range(model.n_k) if axis not in given]
        self._given, self._chosen = np.array(given, int), np.array(chosen)
        even = listed.even_candidates(model, given, listed.AT_ONCE - 2)[:, chosen]
        rows = np.pad(even, ((2, 0), (0, 0)))  # first a stop: in the place of what is proposed
        self._rows = listed.listed_candidates(model, given, rows)
        listed.require_rest(model, self._rows, given)
        numbers = {"room": room, "far": far, "radius": radius}
        self._room, self._far, self._radius = (
            np.float64(at_least(*one)) for one in numbers.items()
        )
        # ranking: every other knot, what errors take until then; the last interval, of creep, alone
        last = model.time.n_steps
        knots = np.unique([*range(EVERY, last, EVERY), max(1, last - 1), last])
        kept = (2 * knots - np.array([[2], [1]])).ravel()
        weights, biases = ((*x[:-1], x[-1][kept]) for x in (model.net.weights, model.net.biases))
        self._few = model.net.replace(weights=weights, biases=biases)
        ways = np.exp(2j * np.pi / FAN * np.arange(FAN))
        taken = [model.tube.errors.support(x)[..., 0] for x in ways.view(float).reshape(-1, 2)]
        taken = np.minimum.reduceat(np.stack(taken, -1), np.append(0, knots[:-1]), axis=1)
        taken = taken.reshape(*model.tube.grid, *taken.shape[1:]).min(axis=tuple(chosen))
        taken = taken.reshape(-1, len(knots), FAN)  # by bins of what is given
        # a table would be read number by number: in its place (bins, knots, 8) where eight of these
        # ways touch the errors, x + iy, and how much too much (bins, knots) that says along others
        slope = (np.roll(taken, -1, axis=-1) - np.roll(taken, 1, axis=-1)) / (2 * ways[1].imag)
        touched = ((taken + 1j * slope) * ways)[..., :: FAN // 8]
        over = (touched[..., None] * ways.conj()).real.max(axis=-2) - taken
        self._over = over.max(axis=-1).clip(0.0).astype(np.float32)
        self._touched = touched.astype(np.complex64)
        # seen from the robot: a goal that holds every end, no obstacle yet
        here = pose_of(np.zeros(2 + (model.rotation is not None)), model)
        scenes = Scenes(model, Disc(float(self._radius)), None, Uncertainty())
        scene = scenes.scene(here, ())
        size = np.abs(scene.z_hi).max() + CORNERS * (far + self._radius + ROUNDED)
        self._empty = scene.arrays.replace(slack=np.float64(float_slack(model, size)))

    def start(self, pose: Any, given: Any, corners: Any, active: Any) -> UnderWay:
        """Certify a stop in each environment. Arguments as of `step`."""
        seen = Seen(*self._seen(pose, given, corners, active))
        rest, zero = jnp.asarray(self._rows[:1]), jnp.zeros(len(seen.pose))
        k = jnp.broadcast_to(rest, (len(zero), rest.shape[1]))
        given = jnp.where(jnp.isfinite(seen.given), seen.given, 0.0)
        none = UnderWay(k, seen.pose, zero, zero, given, zero > 0, zero > 0, self._content)
        new, _, reason = self._decide(none, seen, k[:, self._chosen])
        # of no weak type, or `step` would be compiled twice
        return new.replace(certified=(reason == 0).astype(bool))

    def step(
        self, under_way: UnderWay, pose: Any, given: Any, corners: Any, active: Any, action: Any
    ) -> tuple[UnderWay, Driven]:
        """The nearest certified manoeuvre of each environment, or the one under way.

        pose (b, 2; 3 where the model turns), given (b, n_given): measured now. corners (b, o, v, 2)
        [m] of convex obstacles in the world, counter-clockwise, one repeated where there are fewer;
        active (b, o) bool. action (b, m): proposed. Raises InputError for that of another shield.
        """
        if under_way.shield != self._content:  # static, so compared when it is traced
            raise InputError(
                "under_way: expected what this shield has under way; got that of another model, "
                "robot, ask or act. Begin anew with `start`."
            )
        *of, action = self._seen(pose, given, corners, active, action)
        seen = Seen(*of)
        last = jax.tree.map(jnp.asarray, under_way)
        if last.pose.shape != seen.pose.shape:
            raise InputError(
                f"under_way: expected that of poses {seen.pose.shape}; got {last.pose.shape}."
            )
        finite = jnp.isfinite(action).all(axis=1, keepdims=True)
        proposed = jnp.where(finite, jax.vmap(self._ask)(action), jnp.nan)
        if proposed.shape != (wanted := (len(finite), len(self._chosen))):
            raise InputError(f"ask: expected chosen parameters {wanted}; got {proposed.shape}.")
        new, changed, reason = self._decide(last, seen, proposed)
        driven = jax.vmap(self._act)(new.k, new.steps * self._every, new.given)
        return new.replace(steps=new.steps + 1), Driven(driven, changed, reason)

    def _seen(self, *of: Any) -> list[jax.Array]:
        """All of it in float64. Raises InputError."""
        if not jax.config.jax_enable_x64:
            raise InputError("BatchShield: expected float64; use it within `jax.enable_x64(True)`.")
        with reading("BatchShield", "arrays of numbers"):
            found = list(map(jnp.asarray, of))
        for one in found:
            _real("BatchShield", one)
        if (active := found[3]).dtype != bool:  # of integers, ~ is not "none there"
            raise InputError(f"active: expected bool; got {active.dtype}.")
        b, o = active.shape if active.ndim == 2 else (0, 0)
        turns, n = self._model.rotation is not None, len(self._given)
        told = [x.shape for x in found]
        wanted = [(b, 2 + turns), (b, n), (b, o, *told[2][2:3], 2), (b, o)]
        if told[:4] != wanted or 0 in told[2][2:3] or any(not x[1:] or x[0] != b for x in told):
            pose = "3" if turns else "2; its model declares no rotation"
            raise InputError(
                f"BatchShield: expected one batch, pose (b, {pose}), given (b, {n}), corners "
                f"(b, o, v, 2), active (b, o), action (b, m); got {told}."
            )
        return [x if x is active else x.astype(float) for x in found]

    def _decide(self, last: UnderWay, seen: Seen, proposed: jax.Array):
        """The manoeuvre under way from now on, whether another than the proposed one, a reason.

        Boxes show most proposals safe. Of the other environments all manoeuvres are ranked in
        float32; the nearest is judged, until one is safe or none is left.
        """
        finite = jnp.isfinite(seen.given).all(axis=1, keepdims=True)
        last = last.replace(given=jnp.where(finite, seen.given, last.given))
        reason, left, elsewhere, asked = jax.vmap(self._asked)(last, seen, proposed)
        last = last.replace(left=left, clearance=jnp.where(left, -jnp.inf, last.clearance))
        k = jax.vmap(self._manoeuvre, (0, 0, None))(seen.given, proposed, 0)
        clear = jax.vmap(lambda *of: self._clearance(*of, 0))(seen, k)
        together = 1 if backend().in_turn else min(TOGETHER, len(self._rows))

        def ranked(state: tuple, of: tuple):
            return jnp.zeros((), bool), self._ranked(*of), *state[2:]

        def judged(state: tuple, of: tuple):
            (_, far, *_), (seen, asked) = state, of
            # top_k sorts, which takes a processor as long as three judgements
            near = far.argmin()[None] if together == 1 else jax.lax.top_k(-far, together)[1]
            k = jax.vmap(self._manoeuvre, (None, None, 0))(seen.given, asked.proposed, near)
            gap = jax.vmap(lambda k: self._clearance(seen, k, NEAREST))(k)
            safe = jnp.isfinite(far[near]) & (gap > 0) & (gap >= asked.least)
            i, far = safe.argmax(), far.at[near].set(jnp.inf)  # the nearest of them that is
            more = ~safe.any() & jnp.isfinite(far).any()
            return more, far, k[i], jnp.where(safe[i], gap[i], -jnp.inf)

        may, good = reason == 0, (reason == 0) & (clear > 0) & (clear >= self._room)
        far = jnp.full((len(k), len(self._rows)), jnp.inf)
        state = may & ~good, far, k, jnp.where(good, clear, -jnp.inf)
        _, far, *state = while_open(ranked, state, (seen, asked), AT_ONCE)
        state = jnp.isfinite(far).any(axis=1), far, *state
        _, _, k, clear = while_open(judged, state, (seen, asked), AT_ONCE)
        good = clear > 0
        lost = elsewhere & ~good  # nor is it where its stop was certified
        reason = jnp.where(lost, 3, reason)
        clearance = jnp.where(lost, -jnp.inf, last.clearance)
        last = last.replace(left=last.left | lost, clearance=clearance)
        new = last.replace(k=k, pose=seen.pose, steps=jnp.zeros(len(k)), clearance=clear)
        at = {1: good, 2: good[:, None]}
        new = jax.tree.map(lambda x, y: jnp.where(at[x.ndim], x, y), new, last)
        same = good & (new.k[:, self._chosen] == proposed).all(axis=1)
        return new, ~same, jnp.where(good, 0, jnp.where(reason > 0, reason, 4))

    def _asked(self, last: UnderWay, seen: Seen, proposed: jax.Array):
        """In one environment: why nothing may begin, 0 where it may; whether a pose was outside of
        the tube, or not where one begins; what is asked of a manoeuvre.
        """
        model, chosen, axes = self._model, self._chosen, self._given
        lo, hi = jnp.asarray(model.domain.lo), jnp.asarray(model.domain.hi)
        seconds, fresh = last.steps * self._every, last.steps == 0  # a stop may be replaced at once
        meant = ((lo[chosen] <= proposed) & (proposed <= hi[chosen])).all()
        near = (jnp.abs(_from_robot(seen)) <= self._far).all(axis=(1, 2)) | ~seen.active
        known = ((lo[axes] <= seen.given) & (seen.given <= hi[axes])).all() & near.all()
        known &= jnp.isfinite(seen.pose).all()  # also where nothing is there to be near
        outside = self._outside(last, seen.pose, seconds) > 0
        left = last.left | (~fresh & outside)
        over = fresh | self._leaving.may(seconds)
        # as of `Shield`: what is nearer than the brake under way, with enough room
        ahead = jnp.where(fresh, 0.0, jnp.maximum(0.0, 1.0 - seconds / model.time.t_f))
        brake = self._ask(self._act(last.k, seconds, last.given))
        asked = Asked(proposed, ahead, brake, ahead * jnp.minimum(self._room, last.clearance))
        reason = jnp.select([~meant, ~known, left, ~over], [1, 2, 3, 5], 0)
        return reason, left, fresh & outside, asked

    def _manoeuvre(self, given, proposed, i):
        """(n_k,) of number i; 0 is the proposed one."""
        own = jnp.where(i == 0, proposed, jnp.asarray(self._rows[:, self._chosen])[i])
        return jnp.zeros(self._rows.shape[1]).at[self._given].set(given).at[self._chosen].set(own)

    def _ranked(self, seen: Seen, asked: Asked) -> jax.Array:
        """(candidates,) how far each is from the proposed one; infinite for one that is no nearer
        than the brake under way, or seems to have less than the least clearance. It only proposes.
        """
        lo, hi, n = self._model.domain.lo, self._model.domain.hi, len(self._rows)
        k = jax.vmap(self._manoeuvre, (None, None, 0))(seen.given, asked.proposed, np.arange(n))
        options = jnp.concatenate([k[:, self._chosen], asked.brake[None]])
        away = (options - asked.proposed[None]) / (hi - lo)[None, self._chosen]
        far = jnp.linalg.norm(away, axis=1).at[0].set(0.0)
        far, brake = far[:-1], far[-1]
        nearer = ((asked.ahead <= 0) | (far * asked.ahead < brake)).at[0].set(True)
        corners = jnp.where(seen.active[:, None, None], _from_robot(seen), self._far)
        middle = corners.mean(axis=1)  # what is not there is far away, whatever its corners are
        near = jax.lax.top_k(-(middle**2).sum(axis=1), min(RANKED, len(middle)))[1]
        corners, middle = single(corners[near]), single(middle[near])
        # a disc within each: as wide as its sides are near
        sides = (corners + jnp.roll(corners, 1, axis=1)) / 2 - middle[:, None]
        within = jnp.sqrt((sides**2).sum(axis=-1).min(axis=1)) + single(self._radius)
        axes = jnp.split(jax.vmap(jax.tree.map(single, self._few), out_axes=1)(single(k)), 2)
        # from the nearest place of each part of the way to the nearest obstacle, axis by axis
        bx, by = (jnp.pad(end, ((1, 0), (0, 0)))[:-1] for end in axes)
        px, py = (end - begin for end, begin in zip(axes, (bx, by), strict=True))
        scale = 1 / jnp.maximum(px**2 + py**2, TINY)
        least, x, y = jnp.full(px.shape, jnp.inf, px.dtype), px, py
        for (mx, my), size in zip(middle, within, strict=True):
            ax, ay = mx - bx, my - by
            share = jnp.clip((ax * px + ay * py) * scale, 0, 1)
            ax, ay = ax - share * px, ay - share * py
            gap = jnp.sqrt(ax**2 + ay**2) - size
            x, y = jnp.where(gap < least, ax, x), jnp.where(gap < least, ay, y)
            least = jnp.minimum(gap, least)
        bin = open_bin_of([self._model.tube.edges[i] for i in self._given], seen.given)
        taken = jnp.full(px.shape, -jnp.inf, px.dtype)
        for at in jnp.moveaxis(jnp.asarray(self._touched)[bin], -1, 0)[..., None]:
            taken = jnp.maximum(at.real * x + at.imag * y, taken)
        taken *= jax.lax.rsqrt(jnp.maximum(x**2 + y**2, TINY))
        may = (least - taken + jnp.asarray(self._over)[bin, :, None]).min(axis=0)
        may = may.astype(k.dtype) + SEEN >= asked.least
        return jnp.where(nearer & may, far, jnp.inf)

    def _clearance(self, seen: Seen, k: jax.Array, nearest: int) -> jax.Array:
        """[m] no more than the clearance of one manoeuvre, -inf for one that is not safe whatever
        stands around: by boxes, and of so many obstacles by a direction for each interval.
        """
        net, tube, scene = self._model.net, self._model.tube, self._scene(seen)
        pairs, slack, n = scene.obstacles, scene.slack, min(nearest, len(seen.active))
        found = prediction(net, tube, scene, jnp.zeros(2), k)
        path, inside = found.path, found.reaches & jnp.isfinite(found.path).all()
        around = ErrorBox(jnp.asarray(tube.interval)[found.bin][:, None])
        away = pairs.away(path, around) - 4 * slack
        if n:
            o, errors = jax.lax.top_k(-away, n)[1], tube.during(found.bin)
            gaps = jax.vmap(segment.separation, (None, None, 0, 0))  # of all intervals
            gap, w = gaps(path[:-1].T, path[1:].T, pairs.vertices[o][..., None], pairs.radius[o])
            taken = jax.vmap(errors.support_by_axis)(-w[..., None])[..., 0]
            gap = gap - taken - slack * jnp.abs(w).sum(axis=1)
            away = away.at[o].max(least(jnp.where(pairs.active[o], gap, jnp.inf), axis=1))
        return jnp.where(inside, least(away) if len(away) else jnp.inf, -jnp.inf)

    def _scene(self, seen: Seen) -> SceneArrays:
        """The obstacles as seen from the robot."""
        n = len(seen.active)
        pairs = Obstacles(
            vertices=jnp.where(seen.active[:, None, None], _from_robot(seen), 0.0),
            signs=jnp.zeros((n, 0, 2)),
            radius=jnp.full(n, self._radius + ROUNDED),
            points=jnp.zeros((n, 1), jnp.int32),
            active=jnp.broadcast_to(seen.active[:, None], (n, self._model.time.n_steps)),
        )
        return self._empty.replace(obstacles=pairs, count=jnp.int32(n))

    def _outside(self, last: UnderWay, pose, seconds) -> jax.Array:
        """[m] of the pose beyond the tube of the manoeuvre under way, as of `outside_tube`."""
        tube, time = self._model.tube, self._model.time
        knots = predict(self._model.net, tube.layout, last.k)[0]
        passed = jnp.minimum(seconds / time.dt, time.n_steps)
        before = jnp.minimum(passed.astype(int), time.n_steps - 1)
        way = knots[before] + (passed - before.astype(float)) * (knots[before + 1] - knots[before])
        near = passed + np.array([-1.0, 1.0]) * float(SAME) / time.dt  # at a knot in both intervals
        both = jnp.clip(near.astype(int), 0, time.n_steps - 1)
        allowed = jnp.asarray(tube.interval)[open_bin_of(tube.edges, last.k), both].min(axis=0)
        off = jnp.abs(_turned(pose[:2] - last.pose[:2], last.pose) - way)
        return (off - jnp.maximum(allowed - ROUNDED, ROUNDED)).max()


def _real(name: str, x: jax.Array) -> jax.Array:
    """x itself. Raises InputError for complex numbers, whose imaginary part would be dropped."""
    if jnp.iscomplexobj(x):
        raise InputError(f"{name}: expected real numbers; got complex ones.")
    return x


def _from_robot(seen: Seen) -> jax.Array:
    """(o, v, 2) corners in the frame of the robot."""
    return _turned(seen.corners - seen.pose[None, None, :2], seen.pose)


def _turned(away, pose):
    """From the world into the frame of a pose."""
    if len(pose) == 2:
        return away
    cosine, sine = jnp.cos(pose[2]), jnp.sin(pose[2])
    return away @ jnp.array([[cosine, -sine], [sine, cosine]])
