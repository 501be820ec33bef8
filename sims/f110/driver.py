"""The driver: PID control onto a line at a speed, then an open loop that throws the car around and
stops it.

NumPy over the batch, element by element: a run's commands do not depend on its neighbours, to the
last bit.
"""

import numpy as np

from sims.f110 import params as c


class Driver:
    """Commands for B cars from what the motion capture has shown them. `command` is called once per
    tick, in order.
    """

    def __init__(self, ks: np.ndarray, latency: np.ndarray, ticks: int, origin: np.ndarray):
        """ks (B, 2) line [m] and speed [m/s]; latency (B,) [s]; origin (2,) [m]: where the lab's
        frame lies.
        """
        n = len(ks)
        self.line, self.speed, self.origin = ks[:, 0].copy() + origin[1], ks[:, 1].copy(), origin
        self.delay = latency / c.TICK
        self.seen = np.zeros((ticks + 1, n, 3))
        self.last, self.velocity = None, np.zeros((n, 3))
        self.line_sum, self.speed_sum = np.zeros(n), np.zeros(n)
        self.switched = np.full(n, np.inf)  # [s] when the open loop began

    def command(self, tick: int, measured: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Steering angle (B,) [rad], speed (B,) [m/s] of the rear wheels, front brakes (B,) 0 or 1.

        measured (B, 3): x, y, heading now.
        """
        now = tick * c.TICK
        self.seen[tick] = measured
        x, y, heading = self._delayed(tick)
        self.switched = np.where(
            (x - self.origin[0] > c.SWITCH_X) & np.isinf(self.switched), now, self.switched
        )
        steer, speed = self._follow(now, y, heading)
        since = now - self.switched  # -inf before the switch
        locked = (since >= 0) & (since < c.LOCK_UNTIL)
        power_until = c.POWER_UNTIL + c.POWER_PER_SPEED * (self.speed - c.SPEED_RANGE[0])
        steer = np.where(
            since >= 0, np.where(since < power_until, c.DRIFT_STEER, c.END_STEER), steer
        )
        speed = np.where(
            since >= 0, np.where(locked | (since >= power_until), 0.0, c.POWER_SPEED), speed
        )
        return steer, speed, np.where(since >= power_until, 1.0, 0.0)

    def _delayed(self, tick: int) -> np.ndarray:
        """(3, B): the pose seen now, `delay` ticks old, between two records."""
        back = np.minimum(self.delay, tick)
        whole = np.floor(back)
        share, late = (back - whole)[:, None], tick - whole.astype(int)
        rows = np.arange(len(back))
        pose = (1 - share) * self.seen[late, rows] + share * self.seen[
            np.maximum(late - 1, 0), rows
        ]
        if self.last is not None:
            self.velocity += c.VELOCITY_FILTER * ((pose - self.last) / c.TICK - self.velocity)
        self.last = pose
        return np.ascontiguousarray(pose.T)

    def _follow(
        self, now: float, y: np.ndarray, heading: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        vx, vy, yaw_rate = np.ascontiguousarray(self.velocity.T)
        off, forward = self.line - y, vx * np.cos(heading) + vy * np.sin(heading)
        near = np.abs(off) < 0.2
        self.line_sum = np.where(
            near, self.line_sum + c.LINE_INTEGRAL * c.TICK * off, self.line_sum
        )
        self.line_sum = np.clip(self.line_sum, -c.LINE_LIMIT, c.LINE_LIMIT)
        rolling = np.maximum(forward, 0.7)
        # no steeper than what the tyres can still turn out of before the line is crossed
        steepest = np.sqrt(2 * c.APPROACH_ACCELERATION * np.abs(off)) / rolling
        steepest = np.minimum(steepest, c.APPROACH_LIMIT)
        wanted = np.clip(c.APPROACH_RATE * off / rolling, -steepest, steepest)
        limit = np.minimum(c.STEER_LIMIT, c.WHEELBASE * c.TURN_ACCELERATION / rolling**2)
        turn = c.HEADING_RATE * (wanted + self.line_sum - heading) - c.YAW_RATE_GAIN * yaw_rate
        steer = c.WHEELBASE / rolling * turn
        ramp = np.minimum(
            self.speed, c.LAUNCH * now
        )  # the sum of its errors is how far the car lags behind
        slow = ramp - forward
        self.speed_sum = np.clip(
            self.speed_sum + c.SPEED_INTEGRAL * c.TICK * slow, -c.SPEED_LIMIT, c.SPEED_LIMIT
        )
        speed = np.clip(ramp + c.SPEED_GAIN * slow + self.speed_sum, 0.0, forward + c.WHEELSPIN)
        return np.clip(steer, -limit, limit), speed
