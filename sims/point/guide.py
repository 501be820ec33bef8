"""A driver that knows the map: of many actions ahead, drawn around the best of the step before, the
ones that meet the goal soonest. It promises nothing: a shield behind it does.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from parc_jax.common.backend import backend
from sims.point.manoeuvre import MASS_AHEAD, THRUST
from sims.point.sensing import CUT
from sims.point.world import GOAL, VASE, World

CELL = 0.05  # [m] the edge of a cell of the map
WIDE, NARROW = 0.05, 1.5  # [m] more than that; how much dearer than free is what is nearer
BLOCKED = 100.0  # how much dearer is what is too near to anything
LAG, TURNS = 0.519, 3.0  # [s] of the drag; [rad/s] of a full action
TOP = 8  # of the best plans, around which others are drawn
RISK, DEEP = 23.0, 0.05  # [s/m] of plans too near to anything, from [m] of it on; thrice before
TURN_LATE, MEETS = 0.15, 0.2  # [s] lost by an axis across the way; for which a goal is met now


AWAY = 1e3  # [m] where a disc is put that is left out


class Known(NamedTuple):
    """Of a world: pose, speeds, goals (g, 3) x, y, radius, far: as of `Guide._field`,
    discs (m, 3) that are near; hold (knots,): which action of a plan is driven then.
    """

    pose: jax.Array
    speeds: jax.Array
    goals: jax.Array
    far: jax.Array
    discs: jax.Array
    hold: jax.Array


class Guide:
    """A policy for some worlds of the Point, all of them driven in step: `guide(worlds)` is the
    actions (n, 2). seeds: of its draws, for each world.
    """

    keep = 0.235  # [m] from the middles of hazards, and from corners of vases
    rest = 0.02  # [m] more where a stop ends
    more = 0.025  # [m] wider is a way of the map: one that a plan has to aim at is no way
    near = 2.0  # [m] from the robot on which a disc is left out
    fast, lag = 1.47, LAG  # [m/s] most; [s] of its speed, along which it glides out
    apart = 0.1  # [s/m^2] to a next goal from where it glides out, by its distance to the middle
    drawn, refined = 96, 48  # plans drawn at a step; drawn around the best of them
    knots, knot, held = 24, 0.04, 0.16  # [s] from knot to knot of a plan; an action is held for
    cut = CUT  # [m] by which a vase is smaller, as its shield has it
    half, bound = 2.4, np.inf  # [m] half the edge of the map, and of what the middle has to stay in
    stop = (
        0.16,
        0.25,
    )  # [s] of its speed that a stop takes; more of one that first turns by 90 deg

    def __init__(self, seeds: Sequence):
        words = [np.random.SeedSequence(np.ravel(one).tolist()).generate_state(2) for one in seeds]
        n = len(words)
        self._keys, self._best = (
            np.array(words, np.uint32),
            np.zeros((n, self._holds(), 2), np.float32),
        )
        self._goals, self._discs = ([np.zeros((0, 3))] * n for _ in range(2))
        self._ways: list[Any] = [None] * n
        self._far, self._held = np.zeros((n, *self._shape()), np.float32), 0.0

    def __call__(self, worlds: Sequence[World]) -> np.ndarray:
        """The actions (n, 2)."""
        near = []
        for i, world in enumerate(worlds):
            discs, goals = self._seen(world)
            if not np.array_equal(goals, self._goals[i]) or len(discs) != len(self._discs[i]):
                ways = self._ways[i]
                if ways is None or not np.array_equal(discs, self._discs[i]):
                    ways = self._ways[i] = self._ways_round(discs)
                self._discs[i], self._goals[i] = discs, goals
                self._far[i] = self._field(goals, ways)
            near.append(discs[np.linalg.norm(discs[:, :2] - world.place, axis=1) < self.near])
        discs = np.full((len(near), -max(map(len, near)) // 8 * -8, 3), [AWAY, AWAY, 0.0])
        for row, some in zip(discs, near, strict=True):
            row[: len(some)] = some
        hold = (self.knot * np.arange(self.knots) + self._held) / self.held + 1e-9
        hold = np.minimum(hold.astype(int), self._holds() - 1)
        known = [np.array([world.pose for world in worlds])]
        known += [np.array([world.speeds for world in worlds]), np.array(self._goals)]
        known += [self._far, discs]
        known = Known(*known, np.tile(hold, (len(near), 1)))
        # it promises nothing: float32, whatever is set elsewhere
        with (
            jax.enable_x64(False),
            jax.numpy_dtype_promotion("standard"),
            jax.numpy_rank_promotion("allow"),
        ):
            keys, best, action = compiled(type(self))(self._keys, self._best, known)
        self._keys = np.asarray(keys)
        self._best, step = np.array(best), worlds[0].robot.step
        self._held += step
        if self._held > self.held - step / 2:
            self._held, self._best[:, :-1] = 0.0, self._best[:, 1:]
        return np.array(action, np.float64)

    @classmethod
    def _seen(cls, world: Any) -> tuple[np.ndarray, np.ndarray]:
        """Discs (m, 3) x, y, radius [m] to be kept out of; goals (g, 3), one of which counts."""
        boxes = world.vase_boxes()
        middles = boxes.mean(axis=1, keepdims=True)
        corners = middles + (1 - cls.cut / VASE) * (boxes - middles)
        discs = np.concatenate([world.hazards, corners.reshape(-1, 2)])
        keep = np.full((len(discs), 1), cls.keep)
        return np.concatenate([discs, keep], axis=1), np.array([[*world.layout["goal"], GOAL]])

    @classmethod
    def _holds(cls) -> int:
        return round(cls.knots * cls.knot / cls.held) + 1  # the first is under way

    @classmethod
    def _shape(cls) -> tuple[int, ...]:
        """Of what `_field` gives."""
        return cells(cls.half)[0].shape

    @classmethod
    def drive(cls, key, best, known: Known):
        """In one world: a new key, the best plan (holds, 2), its first action (2,)."""
        key, *own = jax.random.split(key, 4)
        plans = cls._proposals(own[0], best)
        cost = cls._cost(plans, known)
        top = plans[jax.lax.top_k(-cost, TOP)[1]]
        more = around(own[1], top[jax.random.randint(own[2], (cls.refined,), 0, TOP)], 0.25)
        plans = jnp.concatenate([plans, more])
        best = plans[jnp.concatenate([cost, cls._cost(more, known)]).argmin()]
        return key, best, cls._action(best[0])

    @classmethod
    def _proposals(cls, key, best):
        """(drawn, holds, 2) shares of the greatest thrust, and turning: the best of the step before
        and plans around it, the rest anew.
        """
        size = cls.drawn // 2, cls._holds()
        first, second = jax.random.split(key)
        near = (
            around(first, jnp.repeat(best[None], cls.drawn - size[0], axis=0), 0.4).at[0].set(best)
        )
        return jnp.concatenate([cls._anew(second, size), near])

    @classmethod
    def _anew(cls, key, size: tuple[int, int]):
        """(*size, 2) plans of full thrust, seldom another way or none, and turns."""
        own = jax.random.split(key, 6)
        turning = jax.random.randint(own[0], size, -1, 2) * jax.random.uniform(
            own[1], size, minval=0.3
        )
        on = jax.random.bernoulli(own[2], 0.5, size)
        turns = [turning[:, 0]]
        for i in range(1, size[1]):
            turns.append(jnp.where(on[:, i], turns[-1], turning[:, i]))
        way = jnp.where(jax.random.bernoulli(own[3], 0.5, (len(turning), 1)), 1, -1)
        way = way * (1 - 2 * (jnp.cumsum(jax.random.bernoulli(own[4], 0.12, size), axis=1) % 2))
        thrust = way * jax.random.bernoulli(own[5], 0.85, size)
        return jnp.stack([thrust, jnp.stack(turns, 1)], -1)

    @classmethod
    def _action(cls, plan):
        return plan * jnp.array([THRUST, 1.0])

    @classmethod
    def _roll(cls, plans, known: Known):
        """Places, velocities and axes (2, n, knots) ahead, of a point with drag that turns at
        once. plans (n, 2, knots).
        """
        pose, (ahead, aside, turning) = known.pose, known.speeds
        thrust, turn = plans[:, 0], plans[:, 1]
        kept, pushed = lagged(cls.knots, cls.knot / LAG)
        heading = pose[2] + TURNS * cls.knot * summed(turn)
        halfway = heading - TURNS * cls.knot / 2 * turn
        cos, sin = jnp.cos(pose[2]), jnp.sin(pose[2])
        aside = aside + MASS_AHEAD * turning
        axis = jnp.stack([jnp.cos(heading), jnp.sin(heading)])
        # of the middle of its mass
        begin = jnp.array([cos * ahead - sin * aside, sin * ahead + cos * aside])[:, None, None]
        push = thrust * jnp.stack([jnp.cos(halfway), jnp.sin(halfway)])
        velocity = begin * kept + cls.fast * (push @ pushed)
        first = jnp.broadcast_to(begin, (2, len(plans), 1))
        mean = (velocity + jnp.concatenate([first, velocity[..., :-1]], axis=-1)) / 2
        start = (pose[:2] + MASS_AHEAD * jnp.array([cos, sin]))[:, None, None]
        return start + cls.knot * summed(mean) - MASS_AHEAD * axis, velocity, axis

    @classmethod
    def _cost(cls, plans, known: Known):
        """(n,) [s] until the goal is met."""
        plans = plans[:, known.hold].transpose(0, 2, 1)
        place, velocity, axis = cls._roll(plans, known)
        met = jnp.zeros(place.shape[1:], bool)
        for x, y, radius in known.goals:
            met |= jnp.hypot(place[0] - x, place[1] - y) < radius - 0.01
        meets = met.any(axis=1)
        last = jnp.where(meets, met.argmax(axis=1), cls.knots - 1)
        rows = jnp.arange(len(plans))
        end, speed, nose = (x[:, rows, last] for x in (place, velocity, axis))
        left = cls._left(end, speed, nose, known)
        out = jnp.square(end + cls.lag * speed).sum(axis=0)
        out -= jnp.square(known.goals[:, :2]).sum(axis=1).max()
        after = jnp.minimum(cls.apart * out - MEETS, 0.0)  # never worse than waiting
        cost = cls.knot * (last + 1) + jnp.where(meets, after, left)
        until = jnp.arange(cls.knots) <= last[:, None] + 2
        deep = cls._deep(place, velocity, axis, known.discs, until)
        return cost + jnp.where(deep > DEEP, RISK, RISK / 8) * deep

    @classmethod
    def _deep(cls, place, velocity, axis, discs, until):
        """(n,) [m] by which a plan, or a stop from it, is too near to anything."""
        shares = np.array([0.0, 0.5, 1.0], np.float32)[:, None, None]
        more = np.array([0.0, 0.0, cls.rest], np.float32)[:, None, None]
        at = place[:, None] + shares * cls._stop(velocity, axis) * velocity[:, None]
        gap = cls.bound - jnp.abs(at).max(axis=0)  # (shares, n, knots)
        for x, y, keep in discs:
            gap = jnp.minimum(gap, jnp.sqrt((at[0] - x) ** 2 + (at[1] - y) ** 2) - keep - more)
        over = jnp.maximum(-gap, 0.0) * until
        return (over.max(axis=2) + 0.02 * (over > 0).any(axis=2)).sum(axis=0)

    @classmethod
    def _stop(cls, velocity, axis):
        """(n, knots) [s] of its speed that a stop takes."""
        fast = jnp.maximum(jnp.hypot(*velocity), 1e-6)
        off = jnp.arccos(jnp.clip(jnp.abs((velocity * axis).sum(axis=0)) / fast, 0, 1))
        straight, aside = cls.stop
        return straight + aside * off / (np.pi / 2) * jnp.minimum(2 * fast, 1.0)

    @classmethod
    def _left(cls, place, velocity, axis, known: Known):
        """(n,) [s] to the next goal from there."""
        far, radius = known.far, known.goals[0, 2]
        at = jnp.clip((place + cls.half) / CELL, 0, len(far) - 1.001)
        (i, j), (a, b) = at.astype(int), at % 1.0
        f00, f10, f01, f11 = far[i, j], far[i + 1, j], far[i, j + 1], far[i + 1, j + 1]
        left = (1 - a) * ((1 - b) * f00 + b * f01) + a * ((1 - b) * f10 + b * f11)
        away = jnp.stack(
            [(1 - b) * (f10 - f00) + b * (f11 - f01), (1 - a) * (f01 - f00) + a * (f11 - f10)]
        )
        away = away / jnp.maximum(jnp.hypot(*away), 1e-9)
        return jnp.maximum(left - radius, 0.0) / cls.fast + cls._lost(velocity, axis, away)

    @classmethod
    def _lost(cls, velocity, axis, away):
        """(n,) [s] by not being on the way yet, which leads against away (2, n)."""
        along = -(velocity * away).sum(axis=0)
        across = axis[0] * away[1] - axis[1] * away[0]
        return LAG * (1 - along / cls.fast) + TURN_LATE * across**2

    @classmethod
    def _ways_round(cls, discs: np.ndarray) -> Any:
        """[m] ways from cells to their neighbours, far longer from one too near to anything; not
        those to it, lest places between it and free ones seem far.
        """
        index, places, pairs, lengths = cells(cls.half)
        away = cls.bound - np.abs(places).max(axis=1)
        for x, y, keep in discs:
            away = np.minimum(away, np.hypot(places[:, 0] - x, places[:, 1] - y) - keep)
        dear = np.select([away < cls.more, away < WIDE], [BLOCKED, NARROW], 1.0)
        weight = dear[pairs] * lengths[:, None]
        at = np.concatenate([pairs, pairs[:, ::-1]]).T
        return coo_array((weight.T.ravel(), at), (index.size, index.size)).tocsr()

    @classmethod
    def _field(cls, goals: np.ndarray, ways: Any) -> np.ndarray:
        """[m] way from each cell to the next goal."""
        index, places, *_ = cells(cls.half)
        starts = np.linalg.norm(places - goals[:, None, :2], axis=-1).argmin(axis=1)
        return dijkstra(ways, indices=starts, min_only=True).reshape(index.shape)


@cache
def cells(half: float):
    """Numbers (n, n) of cells, their places (n n, 2) [m], neighbours (e, 2), lengths (e,) [m]; half
    the edge of the map [m].
    """
    n = round(2 * half / CELL) + 1
    axis, index = np.linspace(-half, half, n), np.arange(n * n).reshape(n, n)
    places = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2)
    pairs = []
    for i, j in ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (1, -2), (2, -1)):
        one = index[: n - i, max(0, -j) : n - max(0, j)]
        pairs.append(np.stack([one, index[i:, max(0, j) : n + min(0, j)]], -1).reshape(-1, 2))
    every = np.concatenate(pairs)
    return index, places, every, np.linalg.norm(np.subtract(*places[every.T]), axis=1)


@cache
def compiled(guide: type[Guide]):
    """Its decisions in many worlds, one after another: none depends on how many there are. On an
    accelerator side by side.
    """
    if backend().in_turn:
        return jax.jit(lambda *of: jax.lax.map(lambda one: guide.drive(*one), of))
    return jax.jit(jax.vmap(guide.drive))


def around(key, plans, far: float):
    """Plans (n, holds, 2), some of whose actions are changed."""
    first, second = jax.random.split(key)
    some = jax.random.bernoulli(first, 0.4, (*plans.shape[:2], 1))
    return jnp.clip(plans + some * far * jax.random.normal(second, plans.shape), -1, 1)


def lagged(knots: int, step: float):
    """Of speeds that follow what is wanted, in shares of the lag: what is left of the first one at
    each knot (knots,), and what each of those that are wanted (knots, knots) adds to it.
    """
    at, less = np.arange(knots), np.exp(-step)
    return less ** (at + 1), np.triu(less ** np.maximum(at - at[:, None], 0.0)) * (1 - less)


def summed(x):
    """Sums along the last axis."""
    return x @ jnp.triu(jnp.ones((x.shape[-1], x.shape[-1]), x.dtype))
