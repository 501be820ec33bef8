"""PointGoal1 as pure functions of arrays, in MJX: many worlds in one jitted step.

Worlds, reward, cost and observation are the original's, but the vase stands where it was drawn: who
keeps clear of it sees no difference, another passes through it. Nothing touches the robot then: at
distance 0 the floor's contact has no force, in MuJoCo either, and is left out.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco import mjx

from sims.point.environment import observed
from sims.point.manoeuvre import speeds_of
from sims.point.world import BINS, FAR, GOAL, HAZARD, LEVELS, POINT, SUBSTEPS, World

LEVEL = LEVELS[1]
TRIES = 512  # places for a goal that are looked at; without one an episode ends


class Worlds(NamedTuple):
    """pose (b, 3) x, y [m], heading [rad]; velocity (b, 3), its derivative; hazards (b, 8, 2),
    corners of the vase (b, 4, 2) and goal (b, 2) [m].
    """

    pose: jax.Array
    velocity: jax.Array
    hazards: jax.Array
    vase: jax.Array
    goal: jax.Array

    @property
    def speeds(self) -> jax.Array:
        """(b, 3) forwards, to the left [m/s], turning [rad/s]."""
        return speeds_of(self.pose, self.velocity)


class Told(NamedTuple):
    """Of a step: what is seen (b, 60); reward; cost, 0 or 1; ended, where no place for another goal
    was found; entered, where the robot's middle was in a hazard at any step of MJX, (b,).
    """

    seen: jax.Array
    reward: jax.Array
    cost: jax.Array
    ended: jax.Array
    entered: jax.Array


def drawn(seeds) -> tuple[Worlds, np.ndarray]:
    """The original's worlds of some seeds, and what is seen in them (n, 60)."""
    rows, seen = [], []
    for seed in seeds:
        world = World(LEVEL, int(seed))
        (vase,) = world.vase_boxes()
        rows.append((world.pose, np.zeros(3), world.hazards, vase, world.layout["goal"]))
        seen.append(observed(world))
    return Worlds(*(np.array(one) for one in zip(*rows, strict=True))), np.array(seen)


class Goal:
    """The task: `step` is a pure function."""

    def __init__(self):
        model = POINT.model()
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        self._engine, self._magnetic = mjx.put_model(model), np.array(model.opt.magnetic)
        self._gravity = -float(model.opt.gravity[2])
        self._rest = mjx.make_data(self._engine)

    def step(self, worlds: Worlds, action: jax.Array, key: jax.Array) -> tuple[Worlds, Told]:
        """action (b, 2) in [-1, 1], held for a step; key: of places for goals."""
        before = jnp.linalg.norm(worlds.goal - worlds.pose[:, :2], axis=1)
        pose, velocity, pushed, path = jax.vmap(self._physics)(worlds.pose, worlds.velocity, action)
        after = jnp.linalg.norm(worlds.goal - pose[:, :2], axis=1)
        met = after <= GOAL
        worlds = worlds._replace(pose=pose, velocity=velocity)
        other, found = jax.vmap(new_goal)(jax.random.split(key, len(pose)), worlds)
        worlds = worlds._replace(goal=jnp.where(met[:, None], other, worlds.goal))
        away = jnp.linalg.norm(path[:, :, None] - worlds.hazards[:, None], axis=-1)
        inside = ~(away > HAZARD).all(axis=2)
        deep = jnp.linalg.norm(pose[:, None, :2] - worlds.hazards, axis=-1) < HAZARD
        told = Told(
            jax.vmap(self._seen)(worlds, pushed),
            before - after + met,
            deep.any(axis=1).astype(after.dtype),
            met & ~found,
            inside.any(axis=1),
        )
        return worlds, told

    def _physics(self, pose, velocity, action):
        """Of one robot: pose, velocity, acceleration (2,) of its place, places of each substep."""
        data = self._rest.replace(qpos=pose, qvel=velocity, ctrl=action)

        def one(data, _):
            data = mjx.step(self._engine, data)
            return data, data.qpos[:2]

        data, path = jax.lax.scan(one, data, None, SUBSTEPS)
        data = mjx.forward(self._engine, data)
        return data.qpos, data.qvel, data.qacc[:2], path

    def _seen(self, world: Worlds, pushed: jax.Array) -> jax.Array:
        """(60,) the observation of one world, whose robot is accelerated so [m/s^2]."""
        heading = world.pose[2]
        cos, sin, still = jnp.cos(heading), jnp.sin(heading), jnp.zeros_like(heading)
        turn = jnp.array([[cos, -sin], [sin, cos]])  # into the frame of the robot, from the right
        own = [
            *(pushed @ turn),
            still + self._gravity,
            *(world.velocity[:2] @ turn),
            still,
            still,
            still,
            world.velocity[2],
            *(jnp.asarray(self._magnetic[:2]) @ turn),
            still + self._magnetic[2],
        ]
        kinds = (world.goal[None], world.hazards, world.vase.mean(axis=0, keepdims=True))
        lidars = [lidar((places - world.pose[None, :2]) @ turn) for places in kinds]
        return jnp.concatenate([jnp.stack(own), *lidars])


def lidar(away: jax.Array) -> jax.Array:
    """As of `world.lidar`."""
    close = (FAR - jnp.linalg.norm(away, axis=1)) / FAR
    width = 2 * np.pi / BINS
    angle = jnp.arctan2(away[:, 1], away[:, 0]) % (2 * np.pi)
    sector = jnp.floor(angle / width)
    share = (angle - width * sector) / width
    at = jnp.arange(BINS)[None] - sector.astype(int)[:, None]
    parts = jnp.stack([jnp.ones_like(share), share, 1 - share], axis=1)
    beside = jnp.array([0, 1, -1])
    told = (at[:, None] - beside[None, :, None]) % BINS == 0  # (n, 3, BINS)
    found = jnp.where(told, (parts * close[:, None])[..., None], 0.0)
    return found.max(axis=(0, 1)).clip(0.0)


def new_goal(key: jax.Array, world: Worlds):
    """The first of some places in a world that keeps the original's distances, and whether there is
    one.
    """
    keep = LEVEL.keepout
    most = LEVEL.extents - keep["goal"]
    places = jax.random.uniform(key, (TRIES, 2), world.pose.dtype, -most, most)
    others = [world.pose[None, :2], world.hazards, world.vase.mean(axis=0, keepdims=True)]
    kinds = zip(("agent", "hazard", "vase"), others, strict=True)
    least = np.concatenate([np.full(len(x), keep["goal"] + keep[kind]) for kind, x in kinds])
    away = jnp.linalg.norm(places[:, None] - jnp.concatenate(others)[None], axis=-1)
    free = (away >= least[None]).all(axis=1)
    return places[free.argmax()], free.any()
