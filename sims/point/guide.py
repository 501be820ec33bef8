"""A driver that knows the map: of many actions ahead, drawn around the best of the step before, the
ones that meet the goal soonest. It promises nothing: a shield behind it does.
"""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from sims.point.manoeuvre import MASS_AHEAD, THRUST
from sims.point.sensing import CUT
from sims.point.world import GOAL, VASE, World

HALF, CELL = 2.4, 0.05  # [m] half the edge of the map, and of its cells
WIDE, NARROW = 0.05, 1.5  # [m] more than that; how much dearer than free is what is nearer
BLOCKED = 100.0  # how much dearer is what is too near to anything
LAG, TURNS = 0.519, 3.0  # [s] of the drag; [rad/s] of a full action
DRAWN, REFINED, TOP = 96, 48, 8  # plans drawn at a step; drawn around so many of the best
STOP = (0.16, 0.25)  # [s] of its speed that a stop takes; more of one that first turns by 90 deg
RISK, DEEP = 23.0, 0.05  # [s/m] of plans too near to anything, from [m] of it on; thrice before
TURN_LATE, NEXT = 0.15, 0.016  # [s] lost by an axis across the way; by leaving the middle, per m/s


class Guide:
    """A policy for one world of the Point at a time: `guide(world)` is the action (2,). seed: of
    its draws.
    """

    keep = 0.27  # [m] from the middles of hazards, and from corners of vases
    fast = 1.47  # [m/s] most
    knots, knot, held = 24, 0.04, 0.16  # [s] from knot to knot of a plan; an action is held for
    cut = CUT  # [m] by which a vase is smaller, as its shield has it

    def __init__(self, seed=0):
        n = round(2 * HALF / CELL) + 1
        axis = np.linspace(-HALF, HALF, n)
        self._cells = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2)
        self._n, self._goal, self._known = n, np.full(2, np.nan), 0
        index = np.arange(n * n).reshape(n, n)
        pairs = []
        for i, j in ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (1, -2), (2, -1)):
            one = index[: n - i, max(0, -j) : n - max(0, j)]
            pairs.append(np.stack([one, index[i:, max(0, j) : n + min(0, j)]], -1).reshape(-1, 2))
        self._pairs = np.concatenate(pairs)
        self._lengths = np.linalg.norm(np.subtract(*self._cells[self._pairs.T]), axis=1)
        self._draw = np.random.default_rng(seed)
        self._holds = round(self.knots * self.knot / self.held) + 1  # the first is under way
        self._best, self._held = np.zeros((self._holds, 2)), 0.0

    def __call__(self, world: World) -> np.ndarray:
        """The action (2,)."""
        boxes = world.vase_boxes()
        middles = boxes.mean(axis=1, keepdims=True)
        corners = middles + (1 - self.cut / VASE) * (boxes - middles)
        discs = np.concatenate([world.hazards, corners.reshape(-1, 2)])
        goal = world.layout["goal"]
        if not np.array_equal(goal, self._goal) or len(discs) != self._known:
            self._known = len(discs)
            self._goal, self._far = goal.copy(), self._field(goal, discs)
        near = discs[np.linalg.norm(discs - world.place, axis=1) < 2.0]
        plans = self._proposals()
        cost = self._cost(plans, world, near)
        top = plans[np.argsort(cost)[:TOP]]
        more = self._around(top[self._draw.integers(0, TOP, REFINED)], 0.25)
        plans = np.concatenate([plans, more])
        cost = np.concatenate([cost, self._cost(more, world, near)])
        self._best = plans[int(np.argmin(cost))].copy()
        action, step = self._action(self._best[0]), world.robot.step
        self._held += step
        if self._held > self.held - step / 2:
            self._held, self._best[:-1] = 0.0, self._best[1:]
        return action

    def _proposals(self) -> np.ndarray:
        """(DRAWN, HOLDS, 2) shares of the greatest thrust, and turning: the best of the step before
        and plans around it, the rest anew: full thrust, seldom another way or none, and turns.
        """
        draw, size = self._draw, (DRAWN // 2, self._holds)
        turning = draw.choice([-1.0, 0.0, 1.0], size) * draw.uniform(0.3, 1.0, size)
        on = draw.random(size) < 0.5
        for i in range(1, self._holds):
            turning[:, i] = np.where(on[:, i], turning[:, i - 1], turning[:, i])
        way = np.where(draw.random((len(turning), 1)) < 0.5, 1.0, -1.0)
        way = way * (1 - 2 * (np.cumsum(draw.random(size) < 0.12, axis=1) % 2))
        thrust = way * (draw.random(size) > 0.15)
        near = self._around(np.repeat(self._best[None], DRAWN - len(turning), axis=0), 0.4)
        near[0] = self._best
        return np.concatenate([np.stack([thrust, turning], -1), near])

    def _around(self, plans: np.ndarray, far: float) -> np.ndarray:
        some = self._draw.random((*plans.shape[:2], 1)) < 0.4
        return np.clip(plans + some * self._draw.normal(0, far, plans.shape), -1, 1)

    def _action(self, plan: np.ndarray) -> np.ndarray:
        return plan * [THRUST, 1.0]

    def _roll(self, plans: np.ndarray, world: World) -> tuple[np.ndarray, ...]:
        """Places, velocities and axes (2, n, knots) ahead, of a point with drag that turns at
        once. plans (n, 2, knots).
        """
        pose, (ahead, aside, turning) = world.pose, world.speeds
        thrust, turn = plans[:, 0], plans[:, 1]
        # velocity at each knot of the one at the start and of all pushes before it
        at, less = np.arange(self.knots), np.exp(-self.knot / LAG)
        kept = less ** (at + 1)
        pushed = np.tril(less ** np.maximum(at[:, None] - at, 0.0)) * (1 - less) * self.fast
        heading = pose[2] + np.cumsum(TURNS * self.knot * turn, axis=1)
        halfway = heading - TURNS * self.knot / 2 * turn
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        aside = aside + MASS_AHEAD * turning
        axis = np.stack([np.cos(heading), np.sin(heading)])
        # of the middle of its mass
        begin = np.array([cos * ahead - sin * aside, sin * ahead + cos * aside])[:, None, None]
        push = thrust * np.stack([np.cos(halfway), np.sin(halfway)])
        velocity = begin * kept + push @ pushed.T
        first = np.broadcast_to(begin, (2, len(plans), 1))
        mean = (velocity + np.concatenate([first, velocity[..., :-1]], axis=-1)) / 2
        start = (pose[:2] + MASS_AHEAD * np.array([cos, sin]))[:, None, None]
        return start + self.knot * np.cumsum(mean, axis=-1) - MASS_AHEAD * axis, velocity, axis

    def _cost(self, plans: np.ndarray, world: World, discs: np.ndarray) -> np.ndarray:
        """(n,) [s] until the goal is met."""
        hold = ((self.knot * np.arange(self.knots) + self._held) / self.held + 1e-9).astype(int)
        plans = plans[:, np.minimum(hold, self._holds - 1)].transpose(0, 2, 1)
        place, velocity, axis = self._roll(plans, world)
        met = np.hypot(*(place - self._goal[:, None, None])) < GOAL - 0.01
        meets = met.any(axis=1)
        last = np.where(meets, met.argmax(axis=1), self.knots - 1)
        rows = np.arange(len(plans))
        end, speed, nose = (x[:, rows, last] for x in (place, velocity, axis))
        left = self._left(end, speed, nose)
        out = np.einsum("in,in->n", end, speed) / np.maximum(np.hypot(*end), 1e-6)
        cost = self.knot * (last + 1) + np.where(meets, NEXT * out, left)
        if len(discs):
            until = np.arange(self.knots) <= last[:, None] + 2
            deep = self._deep(place, velocity, axis, discs, until)
            cost += np.where(deep > DEEP, RISK, RISK / 8) * deep
        return cost

    def _deep(self, place, velocity, axis, discs, until) -> np.ndarray:
        """(n,) [m] by which a plan, or a stop from it, is too near to anything."""
        stop = self._stop(velocity, axis)
        deep = 0.0
        for share in (0.0, 0.5, 1.0):
            at = place + share * stop * velocity
            gap = np.full(at.shape[1:], np.inf)
            for x, y in discs:
                np.minimum(gap, (at[0] - x) ** 2 + (at[1] - y) ** 2, out=gap)
            over = np.maximum(self.keep - np.sqrt(gap), 0.0) * until
            deep = deep + over.max(axis=1) + 0.02 * (over > 0).any(axis=1)
        return deep

    def _stop(self, velocity: np.ndarray, axis: np.ndarray) -> np.ndarray:
        """(n, knots) [s] of its speed that a stop takes."""
        fast = np.maximum(np.hypot(*velocity), 1e-6)
        off = np.arccos(np.clip(np.abs((velocity * axis).sum(axis=0)) / fast, 0, 1))
        straight, aside = STOP
        return straight + aside * off / (np.pi / 2) * np.minimum(2 * fast, 1.0)

    def _left(self, place, velocity, axis) -> np.ndarray:
        """(n,) [s] to the goal from there."""
        at = np.clip((place + HALF) / CELL, 0, self._n - 1.001)
        (i, j), (a, b) = at.astype(int), at % 1.0
        far = self._far
        f00, f10, f01, f11 = far[i, j], far[i + 1, j], far[i, j + 1], far[i + 1, j + 1]
        left = (1 - a) * ((1 - b) * f00 + b * f01) + a * ((1 - b) * f10 + b * f11)
        away = np.stack(
            [(1 - b) * (f10 - f00) + b * (f11 - f01), (1 - a) * (f01 - f00) + a * (f11 - f10)]
        )
        away /= np.maximum(np.hypot(*away), 1e-9)
        return np.maximum(left - GOAL, 0.0) / self.fast + self._lost(velocity, axis, away)

    def _lost(self, velocity, axis, away) -> np.ndarray:
        """(n,) [s] by not being on the way yet, which leads against away (2, n)."""
        along = -(velocity * away).sum(axis=0)
        across = axis[0] * away[1] - axis[1] * away[0]
        return LAG * (1 - along / self.fast) + TURN_LATE * across**2

    def _field(self, goal: np.ndarray, discs: np.ndarray) -> np.ndarray:
        """[m] way from each cell to the goal, hardly ever through what is too near to anything."""
        away = np.linalg.norm(self._cells[:, None] - discs, axis=-1)
        away = away.min(axis=1)[self._pairs].min(axis=1) - self.keep
        weight = self._lengths * np.select([away < -CELL / 8, away < WIDE], [BLOCKED, NARROW], 1.0)
        size = (len(self._cells), len(self._cells))
        graph = coo_array((weight, self._pairs.T), size).tocsr()
        start = int(np.argmin(np.linalg.norm(self._cells - goal, axis=1)))
        return dijkstra(graph, directed=False, indices=start).reshape(self._n, self._n)
