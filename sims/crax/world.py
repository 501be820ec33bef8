"""CRAX's Point among goals and hazards, in MuJoCo: how a world is drawn, built, judged.

Laws, numbers and the order of random draws are those of crax-bench 0.1.0 (Apache-2.0, CRAX; the
Brax authors; point.xml is its file) in float64, so that equal keys give equal worlds. Nothing moves
but the robot, and a goal that was met.
"""

from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from sims.point.world import Robot, lidar

EXTENTS = 2.5  # [m] half the edge of the square of all places
WALL, THICK, HIGH = 3.0, 0.06, 0.1  # [m] a wall's middle, half its thickness, half its height
AGENT = 0.1  # [m] that is kept free around the robot's start
MARGIN, TRIES = 0.01, 100  # [m] more than that between things; draws for a place
NEARBY = 8  # hazards whose direction is told of
FLOOR = 0.09  # [m] height of the middle of what is drawn
NOISE = 0.005  # of joints and speeds at the start
OFF = 1e-4  # [m] across every distance, which keeps the original's roots from zero
INSIDE, TOUCHED = (
    2.0,
    3.0,
)  # cost in the middle of a flat hazard; of a step that touches a solid one


@dataclass(frozen=True)
class CraxPoint(Robot):
    """The Point with longer steps."""

    def model(self) -> mujoco.MjModel:
        """The robot alone on the floor."""
        return built(mujoco.MjSpec.from_file(str(self.xml)))


POINT = CraxPoint(Path(__file__).with_name("point.xml"), 0.02, substeps=4)


@dataclass(frozen=True)
class Kind:
    """Hazards of a kind. square: cubes, else cylinders. size, height: [m] the radius or half the
    edge, half the height. solid: it costs to touch one, else to be inside, cubes too as if round.
    """

    square: bool
    count: int
    size: float
    height: float
    solid: bool

    @property
    def keepout(self) -> float:
        """[m] as a circle, when places are drawn, as the original rounds it."""
        return rounded(float(np.sqrt(2.0)) * self.size if self.square else self.size)


@dataclass(frozen=True)
class Level:
    """Goals of a radius [m], two at a time, and hazards in the order in which they are drawn."""

    goal: float
    kinds: tuple[Kind, ...]
    goals: int = 2

    @property
    def hazards(self) -> list[Kind]:
        """The kind of each."""
        return [kind for kind in self.kinds for _ in range(kind.count)]


LEVELS = {
    1: Level(0.2, (Kind(False, 12, 0.4, 0.01, False),)),
    2: Level(0.18, (Kind(False, 8, 0.4, 0.01, False), Kind(False, 8, 0.3, 0.4, True))),
    3: Level(
        0.16,
        (
            Kind(True, 6, 0.3, 0.01, False),
            Kind(True, 4, 0.25, 0.5, True),
            Kind(False, 6, 0.35, 0.01, False),
            Kind(False, 4, 0.25, 0.4, True),
        ),
    ),
}
# middles (4, 2) and half the sides (4, 2) [m] of the walls, which all levels have
WALLS = WALL * np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
SIDES = np.where(WALLS != 0, THICK, WALL)


class World:
    """One world of a level with its robot; `step` as the original's. seed: of its key.

    hazards (n, 2), goals (2, 2) [m]: their middles. trace: true poses, every step of MuJoCo.
    """

    def __init__(self, level: Level, seed: int):
        self.level, self.robot, kinds = level, POINT, level.hazards
        with jax.enable_x64(True), _processor():
            self._key, noise, places = _drawn(seed, level)
        self.goals, self.hazards = places[: level.goals], places[level.goals :]
        self.sizes = np.array([kind.size for kind in kinds])
        self.square = np.array([kind.square for kind in kinds])
        self.solid = np.array([kind.solid for kind in kinds])
        self.model = _model(level)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:], self.data.qvel[:] = noise
        middles = np.column_stack([self.hazards, np.full(len(kinds), FLOOR)])
        self.data.mocap_pos[:] = np.concatenate([middles, np.pad(WALLS, ((0, 0), (0, 1)))])
        self.data.mocap_pos[len(kinds) :, 2] = HIGH / 2
        mujoco.mj_forward(self.model, self.data)
        bodies = self.model.geom_bodyid
        own = bodies == self.model.body("agent").id
        obstacles = own | (self.model.body_mocapid[bodies] >= 0)
        self._own, self._obstacles = (set(np.flatnonzero(part)) for part in (own, obstacles))
        self._steps = 0  # since the goals' key was last split
        self.met = 0  # goals in all
        self.trace = [self.pose]

    def step(self, action: np.ndarray) -> tuple[float, dict]:
        """Reward and cost of an action (2,) in [-1, 1], held for a step."""
        self.data.ctrl[:] = action
        touched: set[int] = set()
        for _ in range(self.robot.substeps):
            mujoco.mj_step(self.model, self.data)
            touched |= self._touched()
            self.trace.append(self.pose)
        # as of the original: places are those from which MuJoCo's last step set out
        place, level = self.data.xpos[1, :2], self.level
        away = np.linalg.norm(self.goals - place, axis=1)
        reached = away - rounded(level.goal) <= 0
        depth = 1.0 - np.sqrt(((place - self.hazards) ** 2).sum(axis=1) + OFF**2) / self.sizes
        depth = np.maximum(depth, 0.0)[~self.solid]
        self._steps += 1
        if reached.any():
            with jax.enable_x64(True), _processor():
                drawn = _goals(
                    level, self._key, self._steps, reached, self.goals, place, self.hazards
                )
            self._key, self.goals = drawn[0], np.array(drawn[1])
            self._steps = 0
        self.met += int(reached.sum())
        cost = INSIDE * float(depth.sum()) + TOUCHED * len(touched)
        return float(reached.sum()), {"cost": cost, "touched": len(touched)}

    @property
    def place(self) -> np.ndarray:
        """(2,) [m]."""
        return self.data.qpos[:2].copy()

    @property
    def pose(self) -> np.ndarray:
        """(3,) x, y [m], heading [rad]."""
        return self.data.qpos.copy()

    @property
    def speeds(self) -> np.ndarray:
        """(3,) along its first axis, along its second [m/s], turning [rad/s]."""
        x, y, turning = self.data.qvel
        cos, sin = np.cos(self.data.qpos[2]), np.sin(self.data.qpos[2])
        return np.array([cos * x + sin * y, cos * y - sin * x, turning])

    def observation(self) -> np.ndarray:
        """(62,) the original's: sensors, lidars of goals and hazards, the direction of the first
        goal, those of the nearest hazards.
        """
        seen = [self.data.sensor(name).data for name in self.robot.senses]
        cos, sin = np.cos(self.data.qpos[2]), np.sin(self.data.qpos[2])
        here = self.data.xpos[1, :2]
        turn = np.array([[cos, -sin], [sin, cos]])
        hazards = np.concatenate([self.hazards, WALLS])
        goals, hazards = (self.goals - here) @ turn, (hazards - here) @ turn
        near = hazards[np.argsort((hazards**2).sum(axis=1), kind="stable")[:NEARBY]]
        ways = np.concatenate([goals[:1], near])
        ways = ways / (np.sqrt((ways**2).sum(axis=1, keepdims=True) + OFF**2) + 1e-8)
        return np.concatenate([*seen, lidar(goals, OFF), lidar(hazards, OFF), ways.ravel()])

    def _touched(self) -> set[int]:
        """Bodies of solid hazards and walls that the robot is in contact with."""
        bodies, contact = self.model.geom_bodyid, self.data.contact
        pairs = contact.geom[contact.dist <= 0.0].tolist()
        found = [i if j in self._own else j for i, j in pairs if {i, j} & self._own]
        return {int(bodies[i]) for i in found if i in self._obstacles}


def rounded(size: float) -> float:
    """A size that the original keeps in float32."""
    return float(np.float32(size))


def built(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """With the numbers of the original's physics, and no more memory than needed."""
    spec.njmax, spec.nconmax = -1, -1
    spec.option.solver = mujoco.mjtSolver.mjSOL_CG
    spec.option.iterations, spec.option.ls_iterations = 4, 4
    spec.option.timestep = 0.02
    return spec.compile()


@cache
def _model(level: Level) -> mujoco.MjModel:
    """Robot, hazards and walls, which are put in their places by each world."""
    spec = mujoco.MjSpec.from_file(str(POINT.xml))
    box, cylinder = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
    geoms = [
        (box, [kind.size, kind.size, kind.height], kind.solid)
        if kind.square
        else (cylinder, [kind.size, kind.height, 0.0], kind.solid)
        for kind in level.hazards
    ]
    geoms += [(box, [*half, HIGH], True) for half in SIDES]
    for kind, size, solid in geoms:
        body = spec.worldbody.add_body(mocap=True)
        touches = int(solid)
        body.add_geom(
            type=kind, size=size, contype=touches, conaffinity=touches, solref=[0.01, 1.0]
        )
    return built(spec)


def _processor():
    """Draws are made there, whatever else an accelerator does: a seed names one world."""
    return jax.default_device(jax.local_devices(backend="cpu")[0])


def _drawn(seed: int, level: Level):
    """A key, joints and speeds at the start (2, 3), places of goals and hazards (n, 2)."""
    _, first, second, key = jax.random.split(jax.random.PRNGKey(seed), 4)
    noise = [jax.random.uniform(k, (3,), minval=-NOISE, maxval=NOISE) for k in (first, second)]
    keep = [rounded(level.goal)] * level.goals + [kind.keepout for kind in level.hazards]
    keep = np.array([AGENT, *keep])
    low = (np.float32(-EXTENTS) + keep.astype(np.float32)).astype(np.float64)
    key, places = _placed(key, noise[0][:2], jnp.array(keep), jnp.array(low))
    return key, np.array(noise), np.array(places)


@jax.jit
def _placed(key, agent, keep, low):
    """Places (n, 2) from low (1 + n,) [m] on of things to be kept (1 + n,) [m] apart from the robot
    and each other: of so many drawn the one that is farthest from what is there, pushed away from
    it where too near.
    """
    n = len(keep)

    def place(carry, i):
        key, places = carry
        _, one, other = jax.random.split(key, 3)
        drawn = [
            jax.random.uniform(k, (TRIES,), minval=low[i], maxval=-low[i]) for k in (one, other)
        ]
        drawn = jnp.stack(drawn, axis=1)
        away = jnp.sqrt(((drawn[:, None] - places[None]) ** 2).sum(axis=-1) + OFF**2)
        there = jnp.arange(n) < i
        asked = keep + keep[i] + MARGIN
        free = jnp.where(there[None], away - asked[None], jnp.inf).min(axis=1)
        best = jnp.argmax(free)
        away, new = jnp.where(there, away[best], jnp.inf), drawn[best]
        near = jnp.argmin(away)
        way = new - places[near]
        way = way / (jnp.sqrt((way**2).sum()) + 1e-8)
        pushed = jnp.clip(new + (asked[near] - away[near] + 1e-3) * way, low[i], -low[i])
        new = jnp.where(free[best] >= 0, new, pushed)
        return (jax.random.split(key)[0], places.at[i].set(new)), None

    places = jnp.zeros((n, 2)).at[0].set(agent)
    (key, places), _ = jax.lax.scan(place, (key, places), jnp.arange(1, n))
    return key, places[1:]


@partial(jax.jit, static_argnums=0)
def _goals(level: Level, key, steps, reached, goals, agent, hazards):
    """The key and goals (2, 2) after so many steps at the last of which some were reached: each of
    those in the first place drawn that is free, or where the robot is.
    """
    square = np.array([kind.square for kind in level.hazards])
    sizes = np.array([kind.size for kind in level.hazards])
    radius = rounded(level.goal)
    edge = np.float32(MARGIN) - np.float32(EXTENTS)
    low, wide = float(edge), float(-edge - edge)
    boxes = jnp.concatenate([hazards[square], jnp.array(WALLS)])
    half = np.concatenate([np.repeat(sizes[square][:, None], 2, axis=1), SIDES]) + radius
    discs = jnp.concatenate([agent[None], hazards[~square]])
    round_ = np.append(AGENT, sizes[~square]) + radius

    def passed(key):
        return jax.random.split(key)[0]

    before = level.goals * (steps - 1)
    key = jax.lax.fori_loop(0, before, lambda _, key: passed(key), key)
    for i in range(level.goals):
        others = jnp.delete(goals, i, axis=0)

        def place(key, others=others):
            def attempt(carry, _):
                key, found, there = carry
                key, own = jax.random.split(key)
                new = low + wide * jax.random.uniform(own, (2,))
                within = (jnp.abs(boxes - new[None]) <= half).all(axis=1).any()
                near = (jnp.linalg.norm(discs - new[None], axis=1) < round_).any()
                near |= (jnp.linalg.norm(others - new[None], axis=1) < 2 * radius).any()
                good = ~(within | near)
                return (key, jnp.where(there | ~good, found, new), there | good), None

            begin = (jax.random.split(key)[1], agent, jnp.array(False))
            (key, found, _), _ = jax.lax.scan(attempt, begin, None, TRIES)
            return key, found

        at = goals[i]
        key, new = jax.lax.cond(reached[i], place, lambda key, at=at: (passed(key), at), key)
        goals = goals.at[i].set(new)
    return key, goals
