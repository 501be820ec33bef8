"""Robots in MuJoCo's C engine, on threads: commands in, poses and speeds out, tick by tick."""

import functools
from pathlib import Path

import numpy as np

from sims.jackal import params as c
from sims.jackal.floor import Draws, Law, Travel

XML = Path(__file__).with_name("jackal.xml")
SETTLE = 400  # steps until a robot that is set down stands still


@functools.cache
def model():
    """The nominal robot, compiled once."""
    import mujoco

    return mujoco.MjModel.from_xml_path(str(XML))


@functools.cache
def _standing() -> np.ndarray:
    """qpos (15,) of the nominal robot at rest at the origin."""
    import mujoco

    data = mujoco.MjData(model())
    mujoco.mj_step(model(), data, SETTLE)
    return data.qpos.copy()


def ramped(setpoint: np.ndarray, command: np.ndarray, ramp) -> np.ndarray:
    """The controller's set point (..., 2) one tick later: the command (..., 2), as far as the
    limits let it. ramp: change asked for [m/s^2, rad/s^2], at most the controller's own.
    """
    most = c.TICK * np.minimum(ramp, c.MOST_CHANGE)
    command = np.clip(command, -np.array(c.MOST), c.MOST)
    return setpoint + np.clip(command - setpoint, -most, most)


def wheel_speeds(setpoint: np.ndarray) -> np.ndarray:
    """Speeds (..., 4) [rad/s] of WHEELS that the controller asks for."""
    half = 0.5 * c.TRACK_FACTOR * c.TRACK
    return (setpoint[..., :1] + half * setpoint[..., 1:] * np.array(c.SIDES)) / c.WHEEL_RADIUS


class Robots:
    """B robots at rest at poses (B, 3): x, y [m], heading [rad]. `set_point` (B, 2) is what the
    controller of each holds now; `encoders` (B, 4) [rad/s] what the wheels' encoders have counted
    in the last tick: slip is not seen by them.

    threads: of the C engine, 0 = all cores; the numbers are the same to the bit.
    """

    def __init__(self, law: Law, draws: Draws, poses: np.ndarray, threads: int = 0):
        from mujoco.batch import Batch

        m, poses = model(), np.asarray(poses, np.float64)
        self.batch = Batch(m, nsim=len(poses), nthread=threads)
        chassis = m.body("jackal").id
        self.batch.expand("body_mass")[:, chassis] *= draws.mass
        self.batch.expand("body_inertia")[:, chassis] *= draws.mass[:, None]
        tyres = [m.pair(name).id for name in c.WHEELS]
        self.batch.expand("pair_friction")[:, tyres, :2] = draws.friction[:, :, None]
        self.batch.set_const()
        self.batch.reset()
        self.qpos, self.qvel, self.ctrl = (self.batch.bind(n) for n in ("qpos", "qvel", "ctrl"))
        self.spin = [m.joint(name).dofadr[0] for name in c.WHEELS]
        self.turned = [m.joint(name).qposadr[0] for name in c.WHEELS]
        self.servos = [m.actuator(name).id for name in c.WHEELS]
        self.qpos[:] = _standing()
        self.qpos[:, :2] += poses[:, :2]
        # the rest pose leans by a hair; it turns with the heading
        self.qpos[:, 3:7] = _turned(poses[:, 2], self.qpos[:, 3:7].copy())
        self.travel = Travel(law, draws)
        self.factor = np.ones((len(poses), 4))
        self.set_point = np.zeros((len(poses), 2))
        self.heading = poses[:, 2].copy()
        self.failed = np.zeros(len(poses), bool)
        self.encoders = np.zeros((len(poses), 4))

    def begin(self, measured: np.ndarray) -> None:
        """A new manoeuvre: the ramps of its command begin at the speeds (B, 2) that are measured
        now, not at what the controllers held, which nobody measures.
        """
        self.set_point = np.array(measured, np.float64)

    def step(self, set_point: np.ndarray) -> None:
        """One tick with the controllers at set points (B, 2)."""
        self.set_point = np.asarray(set_point, np.float64)
        self.factor = self.travel.next()
        self.ctrl[:, self.servos] = self.factor * wheel_speeds(self.set_point)
        before = self.qpos[:, self.turned]
        self.batch.step(nstep=c.SUBSTEPS)
        self.encoders = (self.qpos[:, self.turned] - before) / c.TICK / self.factor
        self.failed |= (self.batch.warning != 0).any(axis=(1, 2))
        turn = _heading(self.qpos) - self.heading
        self.heading = self.heading + np.arctan2(np.sin(turn), np.cos(turn))

    def drive(self, commands: np.ndarray, ramp) -> np.ndarray:
        """Ticks with the commands (ticks, B, 2); poses (ticks + 1, B, 3), the first is now."""
        poses = [self.pose]
        for command in commands:
            self.step(ramped(self.set_point, command, ramp))
            poses.append(self.pose)
        return np.stack(poses)

    @property
    def pose(self) -> np.ndarray:
        """(B, 3) x, y [m] of the middle between the wheels, heading [rad, not wrapped]."""
        return np.concatenate([self.qpos[:, :2], self.heading[:, None]], axis=1)

    @property
    def speeds(self) -> np.ndarray:
        """(B, 3) forward, to the left [m/s], turning [rad/s]: of the middle, true."""
        cos, sin = np.cos(self.heading), np.sin(self.heading)
        vx, vy = self.qvel[:, 0], self.qvel[:, 1]
        return np.stack([cos * vx + sin * vy, cos * vy - sin * vx, self.qvel[:, 5]], axis=1)

    def push(self, change: np.ndarray) -> None:
        """Change forward speed and turning (B, 2) at once, of the robot and of its wheels alike:
        the slip stays what it is.
        """
        cos, sin = np.cos(self.heading), np.sin(self.heading)
        self.qvel[:, 0] += cos * change[:, 0]
        self.qvel[:, 1] += sin * change[:, 0]
        self.qvel[:, 5] += change[:, 1]
        self.qvel[:, self.spin] += wheel_speeds(change)


def _heading(qpos: np.ndarray) -> np.ndarray:
    """(B,) [rad] from the quaternions."""
    w, x, y, z = qpos[:, 3:7].T
    return np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def _turned(heading: np.ndarray, quaternions: np.ndarray) -> np.ndarray:
    """Quaternions (B, 4) turned about the vertical by heading (B,) [rad]."""
    cos, sin = np.cos(heading / 2), np.sin(heading / 2)
    w, x, y, z = quaternions.T
    return np.stack([cos * w - sin * z, cos * x - sin * y, cos * y + sin * x, cos * z + sin * w], 1)
