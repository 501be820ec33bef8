"""The tractor in a level yard, for episodes: a manoeuvre begins while it drives, holds a command
for a moment and carries its own stop.

All that a run depends on is in `State`, so that `pj.learning.chained` makes the runs of claims,
and an episode is one `rollout_from_state` after another.
"""

import functools
from dataclasses import asdict, dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from parc_jax.common.keys import generator
from parc_jax.common.sets.box import Box, box
from parc_jax.learning.system import TURNS, TimeGrid, Trajectory, time_grid
from sims.one_run import one_run
from sims.tractor import params as c
from sims.tractor.system import POINTS, XML

SUBSTEPS = 5  # time steps of tractor.xml in a record


@dataclass(frozen=True)
class Ground:
    """What differs between drives and from record to record; uniform, ours, declared with every
    claim. grip: factor on what each axle's tyres hold; speedometer: on the speed asked for.
    steering: [rad] by which it is off. bumps: [N] ahead and aside, less below 0.5 m/s. sensed:
    [m/s], [rad], [rad] by which speed, steering and hitch are measured wrongly.
    """

    grip: tuple[float, float] = (0.9, 1.1)
    speedometer: tuple[float, float] = (0.98, 1.02)
    steering: float = 0.005
    bumps: float = 400.0
    sensed: tuple[float, float, float] = (0.02, 0.005, 0.005)


class State(NamedTuple):
    """Of B tractors, maybe at records. qpos, qvel (..., 5): x, y [m], heading, steering and hitch
    [rad], and their rates. own (..., 5): factors of the grip of three axles and on the speed, what
    steering is off by; for a whole drive. off (..., 3): of what is measured now.
    """

    qpos: np.ndarray
    qvel: np.ndarray
    own: np.ndarray
    off: np.ndarray


@functools.cache
def model():
    """The tractor, compiled once, and its POINTS (9, 2) [m] on tractor and trailer."""
    import mujoco

    m = mujoco.MjModel.from_xml_path(str(XML))
    return m, np.array([m.site(name).pos[:2] for name in POINTS])


@dataclass(frozen=True, eq=False)
class Yard:
    """k = (speed, steering, hitch as measured at the start, speed, steering as commanded) -> p
    (n_record + 1, 9, 2) of POINTS in the frame of the rear axle at the start, q = (heading,) at the
    end. threads: of MuJoCo, 0 = all cores.
    """

    ground: Ground
    domain: Box
    time: TimeGrid
    threads: int = 0

    name: ClassVar[str] = "tractor_yard"
    plant: ClassVar[str] = "mujoco"
    n_p: ClassVar[int] = 2
    n_q: ClassVar[int] = 1
    points: ClassVar[tuple[str, ...]] = POINTS
    rotation: ClassVar[tuple[str, ...]] = (TURNS,)
    p_labels: ClassVar[tuple[str, ...]] = ("x [m]", "y [m]")
    q_labels: ClassVar[tuple[str, ...]] = ("heading [rad]",)
    k_labels: ClassVar[tuple[str, ...]] = (
        "speed at the start [m/s]",
        "steering at the start [rad]",
        "hitch at the start [rad]",
        "speed [m/s]",
        "steering [rad]",
    )
    given: ClassVar[tuple[int, ...]] = (0, 1, 2)  # slip and rates at the start stay hidden

    @property
    def law(self) -> dict:
        """What a claim has to name beside K."""
        return {**asdict(self.ground), "held": c.HELD, "ramps": c.RAMPS}

    def start_state(self, keys) -> State:
        """At rest at the origin, straight, on a ground of its own."""
        own = np.array([self._own(generator(key)) for key in keys])
        qpos, qvel = np.zeros((2, len(own), 5))
        return State(qpos, qvel, own, np.zeros((len(own), 3)))

    def measured(self, states: State) -> np.ndarray:
        """(..., 3) speed [m/s], steering, hitch [rad], as measured."""
        heading = states.qpos[..., 2]
        x, y = states.qvel[..., 0], states.qvel[..., 1]
        along = np.cos(heading) * x + np.sin(heading) * y
        return np.stack([along, states.qpos[..., 3], states.qpos[..., 4]], axis=-1) + states.off

    def rollout_from_state(self, keys, states: State, ks) -> tuple[Trajectory, State]:
        """Manoeuvres ks (B, 5) from states, told from their poses; the states at all records."""
        from mujoco.batch import Batch

        n, ks = self.time.n_record, np.asarray(ks, np.float64)
        states = State(*(np.asarray(part, np.float64) for part in states))
        draws = [generator(key) for key in keys]
        bumps = self.ground.bumps * np.array([s.uniform(-1, 1, (n, 2)) for s in draws])
        off = np.array([s.uniform(-1, 1, (n, 3)) for s in draws]) * self.ground.sensed
        batch = Batch(model()[0], nsim=len(ks), nthread=self.threads)
        batch.reset()
        names = ("qpos", "qvel", "ctrl", "qfrc_applied")
        qpos, qvel, ctrl, pull = (batch.bind(name) for name in names)
        qpos[:], qvel[:] = states.qpos, states.qvel
        asked, found = ks[:, :2].copy(), [(qpos.copy(), qvel.copy())]
        for record in range(n):
            held = record * c.STEP < c.HELD
            goal = np.stack([ks[:, 3] * held, ks[:, 4]], axis=1)
            rough = bumps[:, record] * np.minimum(1.0, asked[:, :1] / 0.5)
            for _ in range(SUBSTEPS):
                pull[:, :2] = turned(rough, qpos[:, 2])
                most = np.array(c.RAMPS) * c.STEP / SUBSTEPS
                asked += np.clip(goal - asked, -most, most)
                ctrl[:] = controls(qpos, qvel, asked, states.own)
                batch.step()
            found.append((qpos.copy(), qvel.copy()))
        qpos, qvel = (np.stack(part, axis=1) for part in zip(*found, strict=True))
        own = np.broadcast_to(states.own[:, None], (*qpos.shape[:2], 5))
        along = State(qpos, qvel, own, np.concatenate([states.off[:, None], off], axis=1))
        return told(qpos), along

    def rollout_batch(self, keys, ks) -> Trajectory:
        """Runs that begin without slip, which chains leave behind."""
        ks = np.asarray(ks, np.float64)
        speed, steering, hitch = ks[:, :3].T
        zero, turning = 0 * speed, speed * np.tan(steering) / c.WHEELBASE
        pulled = speed * np.sin(hitch) + c.HITCH * turning * np.cos(hitch)
        qpos = np.stack([zero, zero, zero, steering, hitch], axis=1)
        rates = [speed, zero, turning, zero, -turning - pulled / c.DRAWBAR]
        state = self.start_state(keys)._replace(qpos=qpos, qvel=np.stack(rates, axis=1))
        return self.rollout_from_state(keys, state, ks)[0]

    rollout = one_run

    def _own(self, draws) -> np.ndarray:
        g = self.ground
        off = g.steering * draws.uniform(-1, 1)
        return np.array([*draws.uniform(*g.grip, 3), draws.uniform(*g.speedometer), off])


def controls(qpos, qvel, asked, own) -> np.ndarray:
    """(B, 5) drive [N], sideways forces of three axles [N] and steering [rad] of speed and steering
    asked for (B, 2).
    """
    cos, sin = np.cos(qpos[:, 2]), np.sin(qpos[:, 2])
    along, across = cos * qvel[:, 0] + sin * qvel[:, 1], cos * qvel[:, 1] - sin * qvel[:, 0]
    turning, steering, hitch = qvel[:, 2], qpos[:, 3], qpos[:, 4]
    front, pulled = across + c.WHEELBASE * turning, across - c.HITCH * turning
    slips = np.stack(
        [
            across,
            np.cos(steering) * front - np.sin(steering) * along,
            np.cos(hitch) * pulled - np.sin(hitch) * along - c.DRAWBAR * (turning + qvel[:, 4]),
        ],
        axis=1,
    )
    sideways = -c.GRIP * own[:, :3] * np.tanh(slips / c.SLIP)
    drive = c.SERVO * (own[:, 3] * asked[:, 0] - along)
    return np.column_stack([drive, sideways, asked[:, 1] + own[:, 4]])


def places(qpos: np.ndarray) -> np.ndarray:
    """(..., 9, 2) [m] of POINTS in the world."""
    on_body = model()[1]
    tractor, trailer = on_body[:5], on_body[5:]
    heading = qpos[..., 2]
    hitch = turned(np.array([-c.HITCH, 0.0]), heading)[..., None, :]
    pulled = turned(trailer, (heading + qpos[..., 4])[..., None]) + hitch
    both = np.concatenate([turned(tractor, heading[..., None]), pulled], axis=-2)
    return qpos[..., None, :2] + both


def turned(x: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """x (..., 2) turned by angles (...) [rad]."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * x[..., 0] - sin * x[..., 1], sin * x[..., 0] + cos * x[..., 1]], -1)


def told(qpos: np.ndarray) -> Trajectory:
    """Runs (B, n, 5) in the frame of the pose at the start of each."""
    home, heading = qpos[:, :1, None, :2], qpos[:, 0, 2]
    p = turned(places(qpos) - home, -heading[:, None, None])
    return Trajectory(p, qpos[:, -1:, 2] - heading[:, None])


def yard(threads: int = 0) -> Yard:
    """The tractor for episodes, on the ground as it is declared."""
    slower, faster = c.SPEED_BEYOND
    lo = [-slower, -c.STEER_BEYOND, -c.HITCH_BEYOND, 0.0, -c.STEER]
    hi = [c.FAST + faster, c.STEER_BEYOND, c.HITCH_BEYOND, c.FAST, c.STEER]
    return Yard(Ground(), box(lo, hi), time_grid(c.YARD_STEP, c.YARD_T_F, c.STEP), threads)
