"""The adapter to crazyflow 0.4.0 (Schuck and others, MIT), a simulator of drones in JAX whose
models were identified from real Crazyflies.
"""

import contextlib
import importlib.util
import itertools
import os
import sys
import warnings
from dataclasses import dataclass
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.arrays import x64
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box, box
from parc_jax.learning.system import TimeGrid, Trajectory, time_grid
from sims.foreign.slot import params as c
from sims.foreign.slot.pilot import FRAME, Flight, command, learned
from sims.quiet import lenient, quiet_import

SIDES = (("front", "rear"), ("left", "right"), ("top", "bottom"))
CORNERS = tuple(map(" ".join, itertools.product(*SIDES)))
POINTS = ("centre", *CORNERS)
PLANTS = {"disturbed": 1.0, "calm": 0.0}  # share of the disturbances of `params`
STEPS = 5  # of crazyflow, at 500 Hz, between two commands
ARMS = 0.5 * np.array([(0, 0, 0), *itertools.product((1, -1), repeat=3)]) * np.array(c.SIZE)


@dataclass(frozen=True, eq=False)
class SlotDrone:
    """k = (speed [m/s], bank [rad], shift of the roll [s]) -> p (n_record + 1, 9, 3) of POINTS,
    q (3,) the velocity at the end, both in the frame of the slot: through the wall, along the slot,
    across it. There the tube is narrow where it matters. Build with `system`.

    data, step: crazyflow's state with its parameters, and its pure step. disturbed: share of the
    disturbances of `params`, 0 for a calm day.
    """

    data: Any
    step: Any
    disturbed: float
    domain: Box
    time: TimeGrid

    name: ClassVar[str] = "slot"
    n_p: ClassVar[int] = 3
    n_q: ClassVar[int] = 3
    points: ClassVar[tuple[str, ...]] = POINTS
    p_labels: ClassVar[tuple[str, ...]] = ("through [m]", "along [m]", "across [m]")
    q_labels: ClassVar[tuple[str, ...]] = tuple(
        f"speed {way} [m/s]" for way in ("through", "along", "across")
    )
    k_labels: ClassVar[tuple[str, ...]] = ("speed [m/s]", "bank [rad]", "shift [s]")

    @property
    def law(self) -> dict[str, float]:
        """What a claim about this system has to name beside K."""
        share = self.disturbed
        return {"force": share * c.FORCE, "mass": share * c.MASS, "inertia": share * c.INERTIA}

    def rollout(self, key: jax.Array, k: jax.Array) -> Trajectory:
        """One run from hovering at the origin."""
        return self.rollout_from(key, k, jnp.zeros_like(k))

    def rollout_from(self, key: jax.Array, k: jax.Array, p0: jax.Array) -> Trajectory:
        """One run from hovering at p0 (3,); p is relative to it."""
        frame = jnp.asarray(FRAME)
        _, places, turns, velocity = self.fly(key, k, frame.T @ p0)
        p = places[:, None] + jnp.einsum("tij,cj->tci", turns, jnp.asarray(ARMS))
        return Trajectory(p @ frame.T, frame @ velocity)

    def fly(self, key: jax.Array, k: jax.Array, p0: jax.Array):
        """Times (n,), places of the centre (n, 3) from the start, rotations (n, 3, 3) and the last
        velocity (3,) of one run from p0 (3,), all in the world, whose z is upward.
        """
        from crazyflow.sim.functional import attitude_control

        with lenient():
            data = self._start(key, p0)
            home = data.states.pos[0, 0]
            weight = c.GRAVITY * self.data.params.mass[0]

            def record(carry, t):
                data, memory = carry
                seen, _ = self._seen(data, home)
                pull, memory = learned(memory, seen)
                roll, pitch, thrust = command(seen, pull, t, k)
                order = jnp.stack([roll, pitch, jnp.zeros_like(roll), thrust * weight / c.GRAVITY])
                data = self.step(attitude_control(data, order[None, None]), n_steps=STEPS)
                seen, turn = self._seen(data, home)
                return (data, memory), (seen.place, turn)

            times = c.STEP * jnp.arange(self.time.n_record)
            (data, _), (places, turns) = jax.lax.scan(record, (data, jnp.zeros(3)), times)
            places = jnp.concatenate([jnp.zeros((1, 3)), places])
            turns = jnp.concatenate([jnp.eye(3)[None], turns])
            return c.STEP * jnp.arange(len(places)), places, turns, data.states.vel[0, 0]

    def _start(self, key: jax.Array, p0: jax.Array):
        """crazyflow's state: at rest, rotors turning, with the disturbances of one run."""
        pull, weigh, turn = jax.random.split(key, 3)
        drone = self.data.params
        mass = drone.mass[0]
        force = self.disturbed * c.FORCE * c.GRAVITY * mass * jax.random.normal(pull, (3,))
        heavy = self.disturbed * c.MASS * jax.random.uniform(weigh, (), minval=-1.0, maxval=1.0)
        off = self.disturbed * c.INERTIA * jax.random.uniform(turn, (3,), minval=-1.0, maxval=1.0)
        spread = jnp.sqrt(1 + off)
        scale = spread[:, None] * spread[None, :]
        params = drone.replace(
            mass=drone.mass * (1 + heavy), J=drone.J * scale, J_inv=drone.J_inv / scale
        )
        curve = drone.rpm2thrust[0]
        bend = jnp.sqrt(curve[1] ** 2 - 4 * curve[2] * (curve[0] - mass * c.GRAVITY / 4))
        states = self.data.states.replace(
            pos=(p0 + jnp.array([0.0, 0.0, c.HEIGHT]))[None, None],
            force=force[None, None],
            rotor_vel=jnp.full((1, 1, 4), (bend - curve[1]) / (2 * curve[2])),
        )
        return self.data.replace(states=states, params=params)

    def _seen(self, data, home) -> tuple[Flight, jax.Array]:
        """What the pilot is told, and the rotation (3, 3) from body to world."""
        states = jax.tree.map(lambda x: x[0, 0], data.states)
        turn = rotation(states.quat)
        curve = self.data.params.rpm2thrust[0]
        push = (curve[0] + curve[1] * states.rotor_vel + curve[2] * states.rotor_vel**2).sum()
        push = push / self.data.params.mass[0]
        return Flight(states.pos - home, states.vel, turn[:, 2], push), turn


def rotation(quaternion: jax.Array) -> jax.Array:
    """(3, 3) from body to world; crazyflow's quaternions (4,) are x, y, z, w."""
    axis = quaternion[:3]
    cross = jnp.cross(jnp.eye(3), axis[None])
    turned = 2 * (jnp.outer(axis, axis) + quaternion[3] * cross)
    return (quaternion[3] ** 2 - axis @ axis) * jnp.eye(3) + turned


def system(plant: str = "disturbed") -> SlotDrone:
    """The drone on a day of one of PLANTS. Raises InputError, also without crazyflow."""
    if plant not in PLANTS:
        raise InputError(f"plant: expected one of {', '.join(PLANTS)}; got {plant!r}.")
    crazyflow = _crazyflow()
    with x64(), lenient(), _without_warnings():
        sim = crazyflow.Sim(
            n_worlds=1,
            drone=crazyflow.Drone.cf21B_500,
            dynamics=crazyflow.Dynamics.first_principles,
            control=crazyflow.Control.attitude,
        )
    lo, hi = zip(c.SPEED, c.BANK, c.SHIFT, strict=True)
    grid = time_grid(c.PLAN_STEP, c.T_FINAL, c.STEP)
    return SlotDrone(sim.data, sim._step, PLANTS[plant], box(lo, hi), grid)


@contextlib.contextmanager
def _without_warnings():
    """crazyflow's model makes MuJoCo warn that it should not be saved, on stderr and in a file
    MUJOCO_LOG.TXT where it is started. Nobody saves it.
    """
    import mujoco

    mujoco.set_mju_user_warning(lambda text: None)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        mujoco.set_mju_user_warning(None)


def _crazyflow():
    """The module, imported as it wants to be: before SciPy, or with SciPy's array interface on."""
    if importlib.util.find_spec("crazyflow") is None:
        raise InputError(
            "slot: expected the package crazyflow, a simulator of drones; it is not installed. "
            "Install it with: pip install 'parc_jax[drone]'"
        )
    switch = "SCIPY_ARRAY_API"
    if "scipy" in sys.modules and os.environ.get(switch) != "1":
        raise InputError(
            "slot: expected crazyflow to be imported before SciPy; SciPy is there already. Load "
            f"the system first, or set {switch}=1 before Python starts."
        )
    os.environ[switch] = "1"
    return quiet_import("crazyflow")
