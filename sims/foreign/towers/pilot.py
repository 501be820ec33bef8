"""The pilot: bank to the left, hold it, level the wings; pitch up, and hold that."""

from math import radians

from sims.foreign.towers import params as c


class Pilot:
    """Stick positions in [-1, 1] for k = (bank [deg], pitch [deg], time banked [s]) and the pitch
    at the start [rad].
    """

    def __init__(self, k, level: float):
        self.bank, self.climb, self.banked = -radians(k[0]), radians(k[1]), float(k[2])
        self.level = level
        self.owed = 0.0

    def stick(self, time: float, roll, pitch, roll_rate, pitch_rate) -> tuple[float, float]:
        """Aileron (right is positive) and elevator (nose down is positive) at a time [s]."""
        turning = c.TURN_AT <= time < c.TURN_AT + self.banked
        off = (self.bank if turning else 0.0) - roll
        low = self.level + self.climb * min(1.0, time / c.PITCH_IN) - pitch
        elevator = c.PITCH_DAMPING * pitch_rate - c.PITCH_GAIN * low - self.owed
        self.owed += c.PITCH_INTEGRAL * low * c.STEP
        return _held(c.ROLL_GAIN * off - c.ROLL_DAMPING * roll_rate), _held(elevator)


def _held(stick: float) -> float:
    return min(1.0, max(-1.0, stick))
