"""Driver and cars together, tick by tick, in MuJoCo's C engine on threads."""

from typing import NamedTuple

import numpy as np

from sims.f110 import params as c
from sims.f110.car import ackermann, batch_of_cars, friction_under_wheels, model
from sims.f110.disturbance import Draws
from sims.f110.driver import Driver

TICKS = round(c.T_FINAL / c.TICK)


class Run(NamedTuple):
    """What happened, true and as recorded. B runs, n + 1 records.

    pose (B, n + 1, 3): x, y [m], heading [rad, not wrapped] in the lab; velocity (B, n + 1, 3) of
    them; measured (B, n + 1, 3): the motion capture's pose; commands (B, n, 3): steering [rad],
    wheel speed [m/s], brake; switched (B,) [s]; failed (B,): MuJoCo warned, so that the run is
    worthless; qpos (B, n + 1, 17), or None unless asked for.
    """

    pose: np.ndarray
    velocity: np.ndarray
    measured: np.ndarray
    commands: np.ndarray
    switched: np.ndarray
    failed: np.ndarray
    qpos: np.ndarray | None

    @property
    def sideslip(self) -> np.ndarray:
        """(B, n + 1) angle [rad] from where the car points to where it goes; 0 below 0.3 m/s, where
        it means little.
        """
        vx, vy = self.velocity[..., 0], self.velocity[..., 1]
        angle = np.arctan2(vy, vx) - self.pose[..., 2]
        return np.where(np.hypot(vx, vy) > 0.3, np.arctan2(np.sin(angle), np.cos(angle)), 0.0)


def simulate(
    ks: np.ndarray,
    draws: Draws,
    ticks: int = TICKS,
    threads: int = 0,
    origin=(0.0, 0.0),
    keep_qpos: bool = False,
) -> Run:
    """Drive B cars with parameters ks (B, 2) for `ticks` ticks.

    threads: of the C engine, 0 = all cores; the result is the same to the bit. origin (2,) [m]:
    where the lab lies. A run that MuJoCo warned about (it would have been reset in silence) is
    marked as failed and is NaN.
    """
    ks, origin = np.asarray(ks, np.float64), np.asarray(origin, np.float64)
    n, m = len(ks), model()
    cars = batch_of_cars(draws, origin, threads)
    qpos, qvel, ctrl = cars.bind("qpos"), cars.bind("qvel"), cars.bind("ctrl")
    friction, tyres = cars.expand("pair_friction"), [m.pair(name).id for name in c.WHEELS]
    driver = Driver(ks, draws.latency, ticks, origin)
    pose, velocity = np.empty((ticks + 1, n, 3)), np.empty((ticks + 1, n, 3))
    commands = np.empty((ticks, n, 3))
    states = np.empty((ticks + 1, n, m.nq)) if keep_qpos else None
    failed, turned = np.zeros(n, bool), draws.start[:, 2].copy()
    for tick in range(ticks + 1):
        turned = _unwrapped(turned, qpos)
        pose[tick, :, :2], pose[tick, :, 2] = qpos[:, :2], turned
        velocity[tick, :, :2], velocity[tick, :, 2] = qvel[:, :2], qvel[:, 5]
        if keep_qpos:
            states[tick] = qpos
        if tick == ticks:
            break
        steer, speed, brake = driver.command(tick, pose[tick] + draws.noise[:, tick])
        commands[tick, :, 0], commands[tick, :, 1], commands[tick, :, 2] = steer, speed, brake
        ctrl[:, 0], ctrl[:, 1] = ackermann(steer + draws.steering)
        ctrl[:, 2:4] = (draws.battery * speed / c.WHEEL_RADIUS)[:, None]
        ctrl[:, 4:] = brake[:, None]
        friction[:, tyres, :2] = friction_under_wheels(draws, pose[tick], origin)[:, :, None]
        cars.step(nstep=c.SUBSTEPS)
        failed |= (cars.warning != 0).any(axis=(1, 2))
    by_run = [np.moveaxis(part, 0, 1) for part in (pose, velocity, commands)]
    for part in by_run:
        part[failed] = np.nan
    noise = draws.noise[:, : ticks + 1]
    films = np.moveaxis(states, 0, 1) if keep_qpos else None
    return Run(by_run[0], by_run[1], by_run[0] + noise, by_run[2], driver.switched, failed, films)


def _unwrapped(turned: np.ndarray, qpos: np.ndarray) -> np.ndarray:
    """Heading (B,) next to the last one; the car stays upright, so the quaternion is a heading to
    first order.
    """
    w, x, y, z = np.ascontiguousarray(qpos[:, 3:7].T)
    heading = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    step = heading - turned
    return turned + np.arctan2(np.sin(step), np.cos(step))
