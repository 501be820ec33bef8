"""The robot for episodes: it is told what to do next, again and again, and goes on being the same
robot.
"""

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.keys import as_key
from sims.jackal import params as c
from sims.jackal.floor import draw
from sims.jackal.robots import Robots
from sims.jackal.system import Jackal


class Driven:
    """One robot, at rest at a pose (x, y [m], heading [rad]), in the simulator of `system`, with
    its law, ramp and time for which a command is held. The key decides all that happens to it.

    A cycle of a loop is `given = robot.measured`, a plan for k = (*given, v, w) from
    `robot.pose`, or from `robot.odometry` with an uncertainty, `robot.begin(v, w)` and
    `robot.drive(seconds)`. Without a new plan `drive` alone goes on with the manoeuvre under way,
    which ends at rest.

    Robots are independent: each may live in a thread of its own. Raises InputError.
    """

    def __init__(self, system: Jackal, pose, key):
        if not isinstance(system, Jackal):
            kind = type(system).__name__
            raise InputError(
                f"Driven: expected the robot in MuJoCo, sims.load('jackal'); got {kind}."
            )
        pose = _numbers("pose", "(x, y [m], heading [rad])", pose, 3)
        draws = draw(system.floor, [as_key(key)])
        self.system = system
        self._robots = Robots(system.floor, draws, pose[None], threads=1)
        self._sensors = draws.sensors[0]
        self._bias = c.GYRO_BIAS * self._sensors.uniform(-1.0, 1.0)
        self._command, self._left = np.zeros(2), 0
        self._next: np.ndarray | None = None  # a command that is on its way ...
        self._waits = 0  # ... for so many ticks more
        self._path, self._reckoned, self._forward = [pose.copy()], [pose.copy()], 0.0
        self._slips = [(0.0, 0.0)]
        self._measure()

    @property
    def time(self) -> float:
        """[s] driven so far."""
        return c.TICK * (len(self._path) - 1)

    @property
    def pose(self) -> np.ndarray:
        """(3,) where it truly is: x, y [m], heading [rad, not wrapped]."""
        return self._robots.pose[0]

    @property
    def speeds(self) -> np.ndarray:
        """(3,) true speeds: forward, to the left [m/s], turning [rad/s]."""
        return self._robots.speeds[0]

    @property
    def measured(self) -> np.ndarray:
        """(2,) speeds as measured now, forward [m/s] and turning [rad/s], each off by at most
        `system.floor.sensed`; one measurement per moment.
        """
        return self._measured.copy()

    @property
    def odometry(self) -> np.ndarray:
        """(3,) where it is as far as wheels and gyro know: dead reckoning from the first pose, less
        the slip that is usual. `sims.jackal.drift` says how far it is off.
        """
        return self._reckoned[-1].copy()

    @property
    def reckoned(self) -> np.ndarray:
        """(n + 1, 3) the same at each tick so far, as `path`."""
        return np.stack(self._reckoned)

    @property
    def slips(self) -> np.ndarray:
        """(n + 1, 2) [m/s] at each tick so far, as far as wheels and gyro know: by how much the
        wheels are faster or slower than the robot on average, and how fast the worst one slides.
        """
        return np.array(self._slips)

    @property
    def path(self) -> np.ndarray:
        """(n + 1, 3) true poses so far, one a tick of 0.02 s, from the start."""
        return np.stack(self._path)

    @property
    def rests(self) -> bool:
        """Is it slower than 1 mm/s and 1 mrad/s?"""
        return bool((np.abs(self.speeds) < 1e-3).all())

    def begin(self, v: float, w: float) -> np.ndarray:
        """Begin the manoeuvre with the command v [m/s], w [rad/s]; what was under way ends here, or
        after `system.thinking`. Returns its k (n_k,): what was measured, the command under way of a
        robot that thinks, and the command. Raises InputError.
        """
        command = _numbers("command", "(v [m/s], w [rad/s])", (v, w), 2)
        before = [self._command if self._left > 0 else np.zeros(2)] * bool(self.system.waits)
        self._next, self._waits = command, self.system.waits
        if not self._waits:
            self._follow(self._measured)
        return np.concatenate([self._measured, *before, command])

    def drive(self, seconds: float) -> None:
        """Go on for so long, a whole number of ticks of 0.02 s, with the manoeuvre under way: its
        command for what is left of `system.moving`, then its stop. Raises InputError.
        """
        ticks = seconds / c.TICK
        if not (ticks >= 0 and abs(ticks - round(ticks)) < 1e-6):
            raise InputError(
                f"drive: expected a whole number of ticks of {c.TICK} s; got {seconds!r} s."
            )
        for _ in range(round(ticks)):
            if self._next is not None and self._waits == 0:
                self._follow(self.speeds[[0, 2]] + self._off())
            self._waits -= 1
            command = self._command if self._left > 0 else np.zeros(2)
            self._left -= 1
            self._robots.drive(command[None, None], self.system.ramp)
            self._reckon()
            self._path.append(self.pose)
        if self._robots.failed[0]:
            raise InputError("drive: MuJoCo gave up on this robot; its numbers are worthless.")
        self._measure()

    def apply(self, v: float, w: float, seconds: float) -> np.ndarray:
        """`begin` and `drive`; returns k (4,)."""
        k = self.begin(v, w)
        self.drive(seconds)
        return k

    def _follow(self, measured: np.ndarray) -> None:
        """The command that was on its way begins, its ramp at the speeds (2,) measured now."""
        self._command, self._left, self._next = self._next, self.system.held, None
        self._robots.begin(measured[None])

    def _off(self) -> np.ndarray:
        return self._sensors.uniform(-1.0, 1.0, 2) * self.system.floor.sensed

    def _measure(self) -> None:
        self._measured = self.speeds[[0, 2]] + self._off()

    def _reckon(self) -> None:
        """One tick of dead reckoning: way from the wheels, turning from the gyro, which integrates
        within the tick. Once all wheels and the robot stand, the gyro is not asked: on four
        tyres it does not turn then.
        """
        encoders = self._robots.encoders[0]
        # tyres slip by as much as they pull, so the robot follows its wheels with a lag
        wheels = c.WHEEL_RADIUS * encoders.mean()
        self._forward += (wheels - self._forward) * c.TICK / (c.TICK + c.SLIP_ALONG)
        noise = c.GYRO_NOISE * self._sensors.standard_normal()
        turn = self.pose[2] - self._path[-1][2] + c.TICK * (self._bias + noise)
        floor = self._forward + 0.5 * c.TRACK * turn / c.TICK * np.array(c.SIDES)
        along = np.abs(c.WHEEL_RADIUS * encoders - floor).max()
        across = 0.5 * c.WHEELBASE * turn / c.TICK
        self._slips.append((abs(wheels - self._forward), float(np.hypot(along, across))))
        if max(np.abs(encoders).max(), abs(self._forward) / c.WHEEL_RADIUS) < c.STANDS:
            self._reckoned.append(self.odometry)
            return
        x, y, heading = self.odometry
        cos, sin = np.cos(heading + 0.5 * turn), np.sin(heading + 0.5 * turn)
        ahead = c.TICK * self._forward
        left = -c.SLIP_OUTWARDS * self._forward * turn
        x, y = x + cos * ahead - sin * left, y + sin * ahead + cos * left
        self._reckoned.append(np.array([x, y, heading + turn]))


def _numbers(what: str, meaning: str, values, n: int) -> np.ndarray:
    values = np.asarray(values, np.float64)
    if values.shape != (n,) or not np.isfinite(values).all():
        raise InputError(f"{what}: expected {n} finite numbers {meaning}; got {values!r:.80}.")
    return values
