"""The Point's manoeuvre as a black box: an action for one step of the environment, then a brake."""

from dataclasses import dataclass
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.sets.box import Box, box
from parc_jax.learning.system import TimeGrid, Trajectory, time_grid
from sims.one_run import one_run
from sims.point.world import POINT, Robot

T_FINAL, KNOT, RECORD = 1.5, 0.03, 0.01  # [s]
AT_A_TIME = 2000  # runs in the engine
THRUST = 0.05  # action from which on the motor's force is at its limit, 15 mN
AHEAD, ASIDE, TURNING = 1.5, 1.0, 3.5  # [m/s], [m/s], [rad/s] most that is measured at a start

# The brake turns the robot's axis along its velocity, nose or tail first, and pushes against it
MASS_AHEAD = 0.01927  # [m] from the origin to the centre of mass
BACKWARDS = (0.1, 0.3)  # [m/s], and share of the speed aside, from which on the tail goes first
SHARE, SOFT = (0.5, 1.5), 0.02  # speed ahead over speed aside between which the push sets in; [m/s]


@dataclass(frozen=True)
class Brake:
    """How a robot stops. stop: action per m/s that stops what is left within a step of the
    environment, m / (0.3 step). align: turning action per m/s of sideways speed.
    """

    robot: Robot
    stop: float
    align: float

    def __call__(self, speeds: np.ndarray, at_start: np.ndarray) -> np.ndarray:
        """Actions (..., 2) of speeds (..., 3) now, forwards, to the left [m/s], turning [rad/s], of
        a manoeuvre that began with at_start (..., 2) [m/s] forwards and to the left. NumPy or JAX.
        """
        xp = jnp if isinstance(speeds, jax.Array) else np
        ahead, aside = speeds[..., 0], speeds[..., 1] + MASS_AHEAD * speeds[..., 2]
        least, of_aside = BACKWARDS
        side = xp.clip(at_start[..., 0] / (least + of_aside * xp.abs(at_start[..., 1])), -1.0, 1.0)
        first, last = SHARE
        # a push against less than half of the velocity would turn it with the robot, not shorten it
        share = xp.abs(ahead) - first * xp.abs(aside) + SOFT
        share = share / ((last - first) * xp.abs(aside) + SOFT)
        push = xp.clip(-self.stop * ahead, -THRUST, THRUST) * xp.clip(share, 0.0, 1.0)
        return xp.stack([push, side * xp.clip(self.align * aside, -1.0, 1.0)], axis=-1)

    def action(self, k: np.ndarray, seconds: float, speeds: np.ndarray) -> np.ndarray:
        """The action (..., 2) of a manoeuvre k (..., 5) so many seconds after its begin. NumPy or
        JAX.
        """
        xp = jnp if isinstance(k, jax.Array) else np
        first = xp.asarray(k)[..., 3:] * xp.array([THRUST, 1.0])
        later = self(xp.asarray(speeds), xp.asarray(k)[..., :2])
        return xp.where(seconds < self.robot.step / 2, first, later)


brake = Brake(POINT, 0.865, 8.0)
action = brake.action


@dataclass(frozen=True, eq=False)
class Point:
    """k = (speed forwards, to the left, turning as measured at the start; thrust as a share of the
    greatest, turning action) -> p (n_record + 1, 2), the robot's middle in the frame of its start.
    threads: of MuJoCo, 0 = all cores.
    """

    domain: Box
    time: TimeGrid
    threads: int = 0
    brake: Brake = brake
    name: str = "point"

    plant: ClassVar[str] = "mujoco"
    n_p: ClassVar[int] = 2
    n_q: ClassVar[int] = 0
    rotation: ClassVar[tuple[str, ...]] = ()
    p_labels: ClassVar[tuple[str, ...]] = ("x [m]", "y [m]")
    k_labels: ClassVar[tuple[str, ...]] = (
        "speed ahead at the start [m/s]",
        "speed to the left at the start [m/s]",
        "turning at the start [rad/s]",
        "thrust",
        "turning",
    )
    given: ClassVar[tuple[int, ...]] = (0, 1, 2)

    @property
    def law(self) -> dict[str, Any]:
        """What a claim has to name beside K."""
        numbers = (self.brake.robot.step, self.brake.stop, self.brake.align)
        numbers += (*BACKWARDS, *SHARE, SOFT)
        return {"brake": ", ".join(map(str, numbers))}

    def rollout_batch(self, keys, ks, rest: float = 0.0) -> Trajectory:
        """Runs of ks (B, 5); nothing is random. rest: [s] for which they go on after the last
        record, which is then recorded too.
        """
        ks = np.asarray(ks, np.float64)
        parts = [self._run(ks[i : i + AT_A_TIME], rest) for i in range(0, len(ks), AT_A_TIME)]
        return Trajectory(np.concatenate(parts), np.zeros((len(ks), 0)))

    rollout = one_run

    def _run(self, ks: np.ndarray, rest: float) -> np.ndarray:
        from mujoco.batch import Batch

        robot = self.brake.robot
        batch = Batch(robot.model(), nsim=len(ks), nthread=self.threads)
        batch.reset()
        qpos, qvel, ctrl = (batch.bind(name) for name in ("qpos", "qvel", "ctrl"))
        qvel[:] = ks[:, :3]
        path = [qpos[:, :2].copy()]
        every = round(self.time.dt_record / robot.physics)
        for step in range(round((self.time.t_f + rest) / robot.step)):
            asked = self.brake.action(ks, robot.step * step, speeds_of(qpos, qvel))
            ctrl[:] = np.clip(asked, -1.0, 1.0)
            for physics in range(robot.substeps):
                batch.step()
                if (physics + 1) % every == 0:
                    path.append(qpos[:, :2].copy())
        return np.stack(path, axis=1)


def speeds_of(qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
    """(B, 3) forwards, to the left, turning of joints (B, 3), NumPy or JAX; slides do not turn."""
    xp = jnp if isinstance(qpos, jax.Array) else np
    cos, sin = xp.cos(qpos[:, 2]), xp.sin(qpos[:, 2])
    x, y, turning = qvel.T
    return xp.stack([cos * x + sin * y, cos * y - sin * x, turning], axis=1)


def system(threads: int = 0) -> Point:
    """The black box."""
    most = np.array([AHEAD, ASIDE, TURNING, 1.0, 1.0])
    return Point(box(-most, most), time_grid(KNOT, T_FINAL, RECORD), threads)
