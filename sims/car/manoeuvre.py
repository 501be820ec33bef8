"""The Car's manoeuvre as a black box: an action for one step of the environment, then no torque,
which brakes: its wheels' damping is above their grip.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.keys import generator
from parc_jax.common.sets.box import Box, box
from parc_jax.learning.system import TimeGrid, Trajectory, time_grid
from sims.one_run import one_run
from sims.point.world import CAR, SUBSTEPS

STEP = CAR.step
T_FINAL, KNOT, RECORD = 0.48, 0.04, 0.02  # [s]
AT_A_TIME = 2000  # runs in the engine
TORQUE = 0.02  # action from which on a wheel's torque is at its limit, 20 mNm
AHEAD, ASIDE, TURNING = 1.0, 0.6, 3.0  # [m/s], [m/s], [rad/s] most that is measured at a start
BOUNCING = 4096  # states of robots that were driven, of which one bounces as each run at its start


def action(k: np.ndarray, seconds: float, speeds: np.ndarray) -> np.ndarray:
    """The action (..., 2) of a manoeuvre k (..., 5) so many seconds after its begin. NumPy or
    JAX.
    """
    xp = jnp if isinstance(k, jax.Array) else np
    return xp.where(seconds < STEP / 2, xp.asarray(k)[..., 3:] * TORQUE, 0.0)


@dataclass(frozen=True, eq=False)
class Car:
    """k = (speed to its right, to its rear, turning as measured at the start; torque of the left
    and right wheel as shares of the greatest) -> p (n_record + 1, 2), its middle in the frame of
    its start. Random: how it bounces at the start. threads: of MuJoCo, 0 = all cores.
    """

    domain: Box
    time: TimeGrid
    threads: int = 0

    name: ClassVar[str] = "car"
    plant: ClassVar[str] = "mujoco"
    n_p: ClassVar[int] = 2
    n_q: ClassVar[int] = 0
    rotation: ClassVar[tuple[str, ...]] = ()
    p_labels: ClassVar[tuple[str, ...]] = ("x [m]", "y [m]")
    k_labels: ClassVar[tuple[str, ...]] = (
        "speed to the right at the start [m/s]",
        "speed to the rear at the start [m/s]",
        "turning at the start [rad/s]",
        "torque left",
        "torque right",
    )
    given: ClassVar[tuple[int, ...]] = (0, 1, 2)

    @property
    def law(self) -> dict[str, Any]:
        """What a claim has to name beside K."""
        return {"brake": "no torque", "start": f"bounces as one of {BOUNCING} robots driven before"}

    def rollout_batch(self, keys, ks, rest: float = 0.0) -> Trajectory:
        """Runs of ks (B, 5). rest: [s] for which they go on after the last record, which is then
        recorded too.
        """
        ks = np.asarray(ks, np.float64)
        which = np.array([int(generator(key).integers(BOUNCING)) for key in keys])
        parts = [slice(i, i + AT_A_TIME) for i in range(0, len(ks), AT_A_TIME)]
        paths = [self._run(ks[part], which[part], rest) for part in parts]
        return Trajectory(np.concatenate(paths), np.zeros((len(ks), 0)))

    rollout = one_run

    def _run(self, ks: np.ndarray, which: np.ndarray, rest: float) -> np.ndarray:
        batch = engine(len(ks), self.threads)
        qpos, qvel, ctrl = (batch.bind(name) for name in ("qpos", "qvel", "ctrl"))
        bounced = bouncing()
        qpos[:], qvel[:] = (rows[which] for rows in bounced)
        qpos[:, :2] = 0.0
        qvel[:, [0, 1, 5]] = ks[:, :3]
        path = [qpos[:, :2].copy()]
        every = round(RECORD / CAR.physics)
        for step in range(round((self.time.t_f + rest) / STEP)):
            ctrl[:] = action(ks, STEP * step, ks[:, :3])
            for physics in range(SUBSTEPS):
                batch.step()
                if (physics + 1) % every == 0:
                    path.append(qpos[:, :2].copy())
        return np.stack(path, axis=1)


def engine(n: int, threads: int):
    """As many Cars, each alone on the floor."""
    import mujoco
    from mujoco.batch import Batch

    batch = Batch(mujoco.MjModel.from_xml_path(str(CAR.xml)), nsim=n, nthread=threads)
    batch.reset()
    return batch


@cache
def bouncing() -> tuple[np.ndarray, np.ndarray]:
    """Joints (BOUNCING, 13) and speeds (BOUNCING, 11) of robots driven for a second by actions that
    often stay as they were, heading along their axes at the start.
    """
    draw, batch = np.random.default_rng(0), engine(BOUNCING, 1)
    qpos, qvel, ctrl = (batch.bind(name) for name in ("qpos", "qvel", "ctrl"))
    for _ in range(round(1.0 / STEP)):
        new = draw.random((BOUNCING, 1)) < 0.3
        ctrl[:] = np.where(new, draw.uniform(-1.5, 1.5, ctrl.shape).clip(-1, 1) * TORQUE, ctrl)
        for _ in range(SUBSTEPS):
            batch.step()
    joints, speeds = qpos.copy(), qvel.copy()
    joints[:, 3:7] = _unturned(joints[:, 3:7])
    return joints, speeds


def _unturned(quat: np.ndarray) -> np.ndarray:
    """Quaternions (n, 4) without their turn about the vertical."""
    w, x, y, z = quat.T
    half = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) / 2
    cos, sin = np.cos(half), -np.sin(half)
    return np.stack([cos * w - sin * z, cos * x - sin * y, cos * y + sin * x, cos * z + sin * w], 1)


def system(threads: int = 0) -> Car:
    """The black box."""
    most = np.array([ASIDE, AHEAD, TURNING, 1.0, 1.0])
    return Car(box(-most, most), time_grid(KNOT, T_FINAL, RECORD), threads)
