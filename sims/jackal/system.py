"""The robot as a black box: a running start, a command held, a stop."""

from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box, box
from parc_jax.common.spelling import rounded_down
from parc_jax.learning.system import TURNS, TimeGrid, Trajectory, time_grid
from sims.jackal import params as c
from sims.jackal.before import running
from sims.jackal.floor import Law, draw, named_law
from sims.one_run import one_run
from sims.rectangle import POINTS, centre_and_corners, require_body

PLANTS = ("mujoco", "twin")


@dataclass(frozen=True, eq=False)
class Manoeuvre:
    """k = (v0, w0 measured at the start, v, w commanded) -> p (n_record + 1, 5, 2) of POINTS, in
    the frame of the pose at the start, q = (heading,) at the end. A robot that thinks has the
    command that is under way at the start between the two, (v0, w0, v before, w before, v, w).

    moving: [s] for which the command is held, before the stop. ramp: [m/s^2], [rad/s^2] of the
    command. size: [m] length and width of the outline. thinking: [s] from the start to the first
    moment of the command. Build with `system`.
    """

    domain: Box
    time: TimeGrid
    floor: Law
    moving: float
    ramp: tuple[float, float]
    size: tuple[float, float]
    thinking: float

    name: ClassVar[str] = "jackal"
    n_p: ClassVar[int] = 2
    n_q: ClassVar[int] = 1
    points: ClassVar[tuple[str, ...]] = POINTS
    rotation: ClassVar[tuple[str, ...]] = (TURNS,)
    p_labels: ClassVar[tuple[str, ...]] = ("x [m]", "y [m]")
    q_labels: ClassVar[tuple[str, ...]] = ("heading [rad]",)

    @property
    def k_labels(self) -> tuple[str, ...]:
        """Names and units of k."""
        before = ("speed before [m/s]", "turning before [rad/s]") if self.thinking else ()
        start = ("speed at the start [m/s]", "turning at the start [rad/s]")
        return (*start, *before, "speed [m/s]", "turning [rad/s]")

    @property
    def given(self) -> tuple[int, ...]:
        """All but the new command; wheels, slip and lean at the start stay hidden."""
        return tuple(range(len(self.k_labels) - 2))

    @property
    def law(self) -> dict[str, Any]:
        """What a claim about this system has to name beside K."""
        told = {"moving": self.moving, "ramp": self.ramp, "size": self.size}
        thinks = {"thinking": self.thinking} if self.thinking else {}
        return {**asdict(self.floor), **told, **thinks}

    @property
    def waits(self) -> int:
        """Ticks from the start to the first one of the command."""
        return round(self.thinking / c.TICK)

    @property
    def held(self) -> int:
        """Ticks for which the command is held."""
        return round(self.moving / c.TICK)

    def commands(self, k: np.ndarray) -> np.ndarray:
        """(n_record, B, 2) of k (B, n_k): that before, the command, then zero."""
        ticks = np.arange(self.time.n_record)[:, None, None] - self.waits
        now = np.where(ticks < self.held, k[None, :, -2:], 0.0)
        return np.where(ticks < 0, k[None, :, -4:-2], now)


@dataclass(frozen=True, eq=False)
class Jackal(Manoeuvre):
    """The manoeuvre in MuJoCo's C engine. threads: of the engine, 0 = all cores."""

    threads: int = 0
    plant: ClassVar[str] = "mujoco"

    def poses(self, keys, k, starts=None) -> np.ndarray:
        """Poses (B, n_record + 1, 3) x, y [m], heading [rad] of runs with keys (B, 2), k (B, 4), in
        the frame of each start. starts (B, 3): pose at which what came before was begun, default 0.
        NaN for a run on which the physics failed.
        """
        k = np.asarray(k, np.float64)
        starts = np.zeros((len(k), 3)) if starts is None else starts
        draws = draw(self.floor, np.asarray(keys))
        robots, commands = running(self, draws, k, starts), self.commands(k)
        waited = robots.drive(commands[: self.waits], self.ramp)
        if self.waits:  # the ramp of a command begins at the speeds that it finds
            off = np.array([s.uniform(-1.0, 1.0, 2) for s in draws.sensors]) * self.floor.sensed
            robots.begin(robots.speeds[:, [0, 2]] + off)
        driven = robots.drive(commands[self.waits :], self.ramp)
        poses = np.moveaxis(np.concatenate([waited[:-1], driven]), 0, 1)
        poses[robots.failed] = np.nan
        return framed(poses)

    def rollout_batch(self, keys, ks) -> Trajectory:
        """p (B, n_record + 1, 5, 2) [m], q (B, 1) [rad] of keys (B, 2), ks (B, 4)."""
        return self._seen(self.poses(keys, ks))

    def rollout_from_batch(self, keys, ks, starts) -> Trajectory:
        """The runs with what came before moved by starts (B, 2) [m]; p is relative to the start."""
        starts = np.asarray(starts, np.float64)
        return self._seen(self.poses(keys, ks, np.pad(starts, ((0, 0), (0, 1)))))

    rollout = one_run

    def _seen(self, poses: np.ndarray) -> Trajectory:
        p = centre_and_corners(poses[..., :2], poses[..., 2], *self.size)
        return Trajectory(p, poses[:, -1, 2:])


def framed(poses: np.ndarray) -> np.ndarray:
    """Poses (B, n, 3) in the frame of the first of each."""
    cos, sin = np.cos(poses[:, :1, 2]), np.sin(poses[:, :1, 2])
    x, y, turned = np.moveaxis(poses - poses[:, :1], -1, 0)
    return np.stack([cos * x + sin * y, cos * y - sin * x, turned], axis=-1)


def system(
    plant: str = "mujoco",
    law: str = "floor",
    body: str = "rectangle",
    moving: float = c.MOVING,
    t_f: float = c.T_FINAL,
    ramp: tuple[float, float] = c.RAMP,
    speed: float = c.SPEED,
    turning: float = c.TURNING,
    backward: float = 0.0,
    thinking: float = 0.0,
    threads: int = 0,
) -> Manoeuvre:
    """The robot. Raises InputError.

    plant: "mujoco", four wheels in contact; or "twin", a quick kinematic one in JAX. law: "floor",
    or "none": nothing differs between runs but what was driven before. body: "rectangle", 0.458 m x
    0.416 m over the wheels, or "outside", 0.508 m x 0.430 m over all that is built on. moving, t_f
    [s]: how long the command is held, and when the robot rests. ramp [m/s^2, rad/s^2] of the
    command; the controller allows (20, 25), the tyres hold about 4.9 m/s^2. speed [m/s], turning
    [rad/s], backward [m/s]: most that is commanded; what is measured reaches a little farther.
    thinking: [s] from the measuring to the first moment of a command, a whole number of ticks of
    0.02 s [T39]. threads: of MuJoCo, 0 = all.
    """
    require_body(body, tuple(c.SIZES))
    if plant not in PLANTS:
        raise InputError(f"jackal plant: expected one of {', '.join(PLANTS)}; got {plant!r}.")
    ramp = tuple(map(float, ramp))
    if len(ramp) != 2 or not min(ramp) > 0:
        raise InputError(f"jackal ramp: expected two positive rates [m/s^2, rad/s^2]; got {ramp}.")
    grid = time_grid(c.PLAN_STEP, t_f, c.TICK)
    if not (0 <= backward <= speed <= c.MOST[0] and speed > 0 and 0 < turning <= c.MOST[1]):
        raise InputError(
            f"jackal: expected speed and turning above 0, up to {c.MOST[0]:g} m/s and "
            f"{c.MOST[1]:g} rad/s, and backward from 0 up to the speed; got {speed:g}, "
            f"{turning:g} and {backward:g}."
        )
    stopping = max(np.array([speed, turning]) / np.minimum(ramp, c.MOST_CHANGE))
    ticks = thinking / c.TICK
    if not (0 <= ticks and abs(ticks - round(ticks)) < 1e-6) or (thinking and plant == "twin"):
        raise InputError(
            f"jackal thinking: expected a whole number of ticks of {c.TICK} s, and none of a twin; "
            f"got {thinking!r} s."
        )
    most = t_f - stopping - thinking
    if not 0 < moving <= most:
        raise InputError(
            f"jackal moving: expected more than 0 and at most {rounded_down(most, 3)} s, "
            f"so that a stop of {stopping:.2f} s fits before t_f = {t_f:g} s; got {moving:g} s."
        )
    slower, faster = c.SPEED_BEYOND
    times = 2 if thinking else 1
    lo = [-backward - slower, -c.TURNING_BEYOND * turning, *times * (-backward, -turning)]
    hi = [speed + faster, c.TURNING_BEYOND * turning, *times * (speed, turning)]
    size = c.SIZES[body]
    about = (box(lo, hi), grid, named_law(law), float(moving), ramp, size, float(thinking))
    if plant == "twin":
        from sims.jackal.twin import Twin

        return Twin(*about)
    return Jackal(*about, threads)
