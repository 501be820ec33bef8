"""The competition's car as a black box: from rest, or rolling, it drives a way, and rests.

The plant is a kinematic bicycle whose motor and steering lag; its driver sees an odometer and a
steering wheel that are a little wrong, and a slope that nobody told it.

Manoeuvres last as long as they have to, so their records are not spaced in time but by progress:
the first interval of a manoeuvre is the standing car that turns its wheels, the last one the brake,
and each between them an equal share of the way that is asked for. `moments` has their times. From
LEAVE of these shares on the next manoeuvre may begin: the car rolls then.
"""

import math
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.sets.box import Box, box
from parc_jax.learning.system import TURNS, TimeGrid, Trajectory, time_grid

# the competition's car and its limits, as `cases.json` has them
LENGTH, WIDTH, WHEELBASE, BEHIND = 4.689, 1.942, 2.8, 0.929  # [m]; BEHIND: the rear overhang
SPEED, ACCELERATION, STEERING, RATE = 2.5, 1.0, 0.75, 0.5  # most, [m/s, m/s^2, rad, rad/s]

POINTS = ("rear axle", "front left", "rear left", "rear right", "front right")
CORNERS = np.array([[x, y] for x, y in ((1, 1), (0, 1), (0, -1), (1, -1))]) * [
    LENGTH,
    WIDTH / 2,
] - [BEHIND, 0.0]

WAY, TURN = 8.0, 0.74  # most that is asked for: [m] of way, [rad] of steering
BEND = 1.2  # [rad] most that the car turns in a manoeuvre: steering is asked for as a share of that
TIGHT = WHEELBASE * BEND / math.tan(TURN)  # [m] of the longest way that may turn all along it
# [m] of ways that k has at 0, 1/4, 1/2, 3/4 and 1: short ones are told apart more finely, and in
# between it is linear, as the way itself is and as the network is by parts
WAYS = np.array([0.0, 0.2, 1.0, TIGHT, WAY])
SHARES, LEAVE = 16, 9  # intervals of the way, and those of them before it may be left while rolling
ROLLS_ON = LEAVE + 1  # likewise, the interval of the standing car included
# of what k has as its start: below TURNED the wheels turn before the car drives, at STANDS while it
# drives, in between both; above it rolls, at 1 with SPEED. AT_REST: where the wheels are turned
TURNED, STANDS, AT_REST = 0.2, 0.4, 0.1
# of what k has as its way: where less is told, the car rolls less, in no gear not at all
ROLLS = 0.25
EVERY = 4  # records of an interval
SUBSTEPS = 12  # of the integration between records
MARGIN = 0.96  # share of the limits of speed and rate that the driver plans with
PLANNED, BRAKING = 0.83, 0.76  # [m/s^2] of the plan, and with which it is sure to stop
SERVO, MOTOR, BRAKE = 0.08, 0.1, 0.05  # [s] lags
SETTLE = 0.1  # [s] after the wheels should stand, and [s] of the brake, twice its lag
# a car that hands over rolls on evenly or brakes: [m/s^2] of the motor in the middle of these, and
# the speed [m/s] from which on it has all of it
PUSH, EVEN = -0.45, 0.3
CREEP = 0.1  # [s] after the way should have been driven, until the brake
WAY_GAIN, SPEED_GAIN, LAST_GAIN = 2.0, 10.0, 4.0  # [1/s] of the driver; the last is near the end


@dataclass(frozen=True)
class Law:
    """What differs between runs, uniform in plus or minus so much. odometer: share of the way.
    steering: [rad] of its zero. slope: [m/s^2] along the car. motor: share of its force. pushes:
    [m/s^2] of the motor where a car that rolls begins, around PUSH.
    """

    odometer: float = 0.003
    steering: float = 0.002
    slope: float = 0.03
    motor: float = 0.03
    pushes: float = 0.6


def corners(x, y, heading):
    """Places (..., 5, 2) [m] of POINTS, of the rear axle's x, y and heading. NumPy or JAX."""
    xp = jnp if isinstance(x, jax.Array) else np
    cos, sin = xp.cos(heading)[..., None], xp.sin(heading)[..., None]
    around = np.concatenate([np.zeros((1, 2)), CORNERS]).T
    ahead, left = (xp.asarray(side, x.dtype).reshape((1,) * x.ndim + (-1,)) for side in around)
    return xp.stack(
        [x[..., None] + cos * ahead - sin * left, y[..., None] + sin * ahead + cos * left], axis=-1
    )


def way_of(told):
    """[m] of the way, negative backwards, of what k has in its place, by WAYS."""
    xp = jnp if isinstance(told, jax.Array) else np
    told = xp.asarray(told)
    at, ways = (xp.asarray(each, told.dtype) for each in (np.linspace(0.0, 1.0, len(WAYS)), WAYS))
    return xp.sign(told) * xp.interp(xp.abs(told), at, ways)


def told_of(way):
    """What k has in place of a way [m]."""
    return np.sign(way) * np.interp(np.abs(way), WAYS, np.linspace(0.0, 1.0, len(WAYS)))


def most_steering(way):
    """[rad] with which the car turns by BEND along a way [m]; not more than TURN."""
    xp = jnp if isinstance(way, jax.Array) else np
    return xp.arctan(WHEELBASE * BEND / xp.maximum(abs(way), TIGHT))


def rolls_at(start, told=1.0):
    """[m/s] at which the car rolls where it begins, of what k has as its start and its way."""
    xp = jnp if isinstance(start, jax.Array) else np
    share = xp.maximum(start - STANDS, 0.0) / (1.0 - STANDS)
    return SPEED * share * xp.minimum(abs(told) / ROLLS, 1.0)


def start_of(speed):
    """What k has as the start of a car that rolls at a speed [m/s], its way ROLLS or more."""
    return STANDS + (1.0 - STANDS) * np.minimum(speed / SPEED, 1.0)


def starts_at(standing):
    """What k has as the start of a car that stands for that share of a turn of its wheels."""
    return np.where(standing < 1.0, STANDS - (STANDS - TURNED) * standing, AT_REST)


def stopping(speed):
    """[m] that a car needs to stop; no way is shorter."""
    return speed**2 / (2 * BRAKING)


def asked_of(k):
    """Of k (5,): the way [m], negative backwards; steering [rad] where it begins, and where it
    ends; speed [m/s] at its start, and the share of the wheels' turn that the car stands for.
    """
    xp = jnp if isinstance(k, jax.Array) else np
    speed, told = rolls_at(k[1], k[2]), way_of(k[2])
    way = told * (1.0 - stopping(speed) / WAY) + xp.sign(k[2]) * stopping(speed)
    most = most_steering(way)
    standing = xp.clip((STANDS - k[1]) / (STANDS - TURNED), 0.0, 1.0)
    return way, most * k[3], most * k[4], speed, standing


class Plan(NamedTuple):
    """Speeds of a way: from `begins` to `cruise`, even, and to rest. lasts: [s]. All [m], [m/s]."""

    way: Any
    begins: Any
    cruise: Any
    lasts: Any

    def edges(self):
        """[s] and [m] from its beginning at which the car has, and leaves, the speed of cruise."""
        a = PLANNED
        changes = abs(self.cruise - self.begins) / a
        return (changes, 0.5 * (self.begins + self.cruise) * changes), (
            self.lasts - self.cruise / a,
            self.way - self.cruise**2 / (2 * a),
        )


def plan_of(way, swing, begins=0.0) -> Plan:
    """How a way [m] above 0 is driven in which the wheels turn by swing [rad]; begins: [m/s] at its
    start, from which the car can stop within it.
    """
    xp = jnp if isinstance(way, jax.Array) else np
    a = PLANNED
    slow = MARGIN * RATE * way / xp.maximum(abs(swing), 1e-3)
    cruise = xp.minimum(MARGIN * SPEED, xp.minimum(slow, xp.sqrt(a * way + 0.5 * begins**2)))
    changes = abs(cruise - begins) / a
    even = way - 0.5 * (begins + cruise) * changes - cruise**2 / (2 * a)
    return Plan(way, begins, cruise, changes + even / cruise + cruise / a)


def passes(plan: Plan, at):
    """[s] and [m/s] when a plan has led so far [m]."""
    xp = jnp if isinstance(at, jax.Array) else np
    (changed, ramp), (_, slows) = plan.edges()
    a, left = PLANNED, xp.maximum(plan.way - at, 0.0)
    up = xp.where(plan.cruise < plan.begins, -a, a)
    reached = xp.sqrt(xp.maximum(plan.begins**2 + 2 * up * xp.minimum(at, ramp), 0.0))
    slowed = xp.sqrt(2 * a * left)
    first, last = at < ramp, at > slows
    even = changed + (at - ramp) / plan.cruise
    seconds = xp.where(last, plan.lasts - slowed / a, even)
    speed = xp.where(last, slowed, plan.cruise)
    # rounding may not turn the clock back where it begins
    rising = xp.maximum((reached - plan.begins) / up, 0.0)
    return xp.where(first, rising, seconds), xp.where(first, reached, speed)


def moments(k):
    """(n_record + 1,) [s] of the records of a manoeuvre k (5,), from its beginning."""
    xp = jnp if isinstance(k, jax.Array) else np
    way, first, last, speed, standing = asked_of(k)
    way = xp.maximum(abs(way), 1e-3)
    stand = standing * (abs(first - k[0]) / (MARGIN * RATE) + SETTLE)
    plan = plan_of(way, last - first, speed)
    share = xp.linspace(0.0, 1.0, SHARES * EVERY + 1, dtype=k.dtype)
    edge = xp.linspace(0.0, 1.0, EVERY + 1, dtype=k.dtype)
    drive = passes(plan, way * share)[0] + CREEP * share**8
    ends = stand + plan.lasts + CREEP
    return xp.concatenate([stand * edge[:-1], stand + drive, ends + SETTLE * edge[1:]])


@dataclass(frozen=True, eq=False)
class Car:
    """k = (steering before [rad]; the start: from rest below STANDS, its wheels turned first below
    TURNED, while it drives at STANDS, and rolling above; the way beyond that to stop in, as
    `way_of` has it; steering where the way begins and where it ends, linear in between, as shares
    of the most that `most_steering` allows) -> p (n_record + 1, 5, 2) of POINTS in the frame of the
    rear axle at the start, q = (heading,) at the end. Build with `system`.
    """

    domain: Box
    time: TimeGrid
    spread: Law

    name: ClassVar[str] = "parking"
    n_p: ClassVar[int] = 2
    n_q: ClassVar[int] = 1
    points: ClassVar[tuple[str, ...]] = POINTS
    rotation: ClassVar[tuple[str, ...]] = (TURNS,)
    p_labels: ClassVar[tuple[str, ...]] = ("x [m]", "y [m]")
    q_labels: ClassVar[tuple[str, ...]] = ("heading [rad]",)
    k_labels: ClassVar[tuple[str, ...]] = (
        "steering before [rad]",
        "start",
        "way, finer near none",
        "steering first",
        "steering last",
    )
    given: ClassVar[tuple[int, ...]] = (0, 1)

    @property
    def law(self) -> dict[str, Any]:
        """What a claim about this system has to name beside K."""
        clock = f"progress: 1 to turn the wheels, {SHARES} equal shares of the way, 1 to brake"
        return {**asdict(self.spread), "clock": clock}

    def rollout(self, key: jax.Array, k: jax.Array) -> Trajectory:
        """One run."""
        zero = jnp.zeros((), k.dtype)
        return self._seen(self.states(key, k), jnp.stack([zero, zero]), zero)

    def rollout_from(self, key: jax.Array, k: jax.Array, p0: jax.Array) -> Trajectory:
        """One run from p0 (2,) [m]; p is relative to it."""
        return self._seen(self.states(key, k, p0), p0, jnp.zeros((), k.dtype))

    def rollout_headed(self, key: jax.Array, k: jax.Array, heading: jax.Array) -> Trajectory:
        """One run with that heading [rad] at the start; p is not turned back."""
        zero = jnp.zeros(2, k.dtype)
        return self._seen(self.states(key, k, zero, heading), zero, heading)

    def _seen(self, states: jax.Array, p0: jax.Array, _heading) -> Trajectory:
        x, y, heading = states[:, 0] - p0[0], states[:, 1] - p0[1], states[:, 2]
        return Trajectory(corners(x, y, heading), states[-1:, 2])

    def states(self, key: jax.Array, k: jax.Array, p0=None, heading=0.0, push=None) -> jax.Array:
        """(n_record + 1, 6) x, y [m], heading [rad], speed [m/s], steering [rad], push of the motor
        [m/s^2] at the records. push: at the start, of a car that rolls; drawn by default.
        """
        law, n = self.spread, jnp.array(jax.random.uniform(key, (5,), k.dtype, -1.0, 1.0))
        odometer, zero, slope, motor = (
            1.0 + law.odometer * n[0],
            law.steering * n[1],
            law.slope * n[2],
            1.0 + law.motor * n[3],
        )
        way, first, last, begins, _ = asked_of(k)
        size, sign = jnp.maximum(jnp.abs(way), 1e-3), jnp.sign(way)
        plan = plan_of(size, last - first, begins)
        (changed, ramp), (slows, _) = plan.edges()
        times = moments(k)
        stand, lasts, a = times[EVERY], plan.lasts, PLANNED
        up = jnp.where(plan.cruise < begins, -a, a)
        rolling = jnp.minimum(begins / EVEN, 1.0)

        def planned(t):  # way, speed and push, at a time of the drive
            t = jnp.clip(t, 0.0, lasts)
            left = lasts - t
            at = jnp.where(
                t < changed, begins * t + 0.5 * up * t**2, ramp + plan.cruise * (t - changed)
            )
            at = jnp.where(t > slows, size - 0.5 * a * left**2, at)
            speed = jnp.where(t < changed, begins + up * t, plan.cruise)
            speed = jnp.where(t > slows, a * left, speed)
            push = jnp.where(t > slows, -a, jnp.where(t < changed, up, 0.0))
            return at, speed, push

        def substep(state, at):
            t, h = at
            x, y, turned, speed, steering, force, told = state
            goes, ends = t >= stand, t >= stand + lasts + CREEP
            way_asked, speed_asked, push = planned(t - stand)
            push = planned(t - stand + MOTOR)[2]
            wheel = jnp.where(goes, first + (last - first) * way_asked / size, first)
            change = jnp.clip((wheel - steering) / SERVO, -RATE, RATE)
            left = jnp.maximum(size - told, 0.0)
            slow = jnp.minimum(jnp.sqrt(2 * BRAKING * left), LAST_GAIN * left)
            aim = jnp.minimum(speed_asked + WAY_GAIN * (way_asked - told), slow)
            asked = jnp.clip(push + SPEED_GAIN * (aim - speed), -ACCELERATION, ACCELERATION)
            force = force + (asked - force) * -jnp.expm1(-h / MOTOR)
            pulled = jnp.clip(motor * force + sign * slope, -ACCELERATION, ACCELERATION)
            drives = jnp.clip(speed + h * pulled, 0.0, SPEED)  # the other gear is another manoeuvre
            brakes = speed * jnp.exp(-h / BRAKE)
            after = jnp.where(ends, brakes, jnp.where(goes, drives, 0.0))
            force = jnp.where(goes, force, 0.0)
            middle = 0.5 * h * (speed + after)
            true = jnp.clip(steering + zero, -STEERING, STEERING)
            bend = sign * middle * jnp.tan(true) / WHEELBASE
            x = x + sign * middle * jnp.cos(turned + 0.5 * bend)
            y = y + sign * middle * jnp.sin(turned + 0.5 * bend)
            state = (
                x,
                y,
                turned + bend,
                after,
                steering + h * change,
                force,
                told + odometer * middle,
            )
            return state, None

        def record(state, span):
            begin, end = span
            h = (end - begin) / SUBSTEPS
            ticks = begin + h * jnp.arange(SUBSTEPS, dtype=k.dtype)
            state, _ = jax.lax.scan(substep, state, (ticks, jnp.full(SUBSTEPS, h)))
            return state, jnp.stack(state[:6])

        p0 = jnp.zeros(2, k.dtype) if p0 is None else p0
        nothing = jnp.zeros((), k.dtype)
        heading = nothing + heading
        force = rolling * (PUSH + law.pushes * n[4]) if push is None else nothing + push
        start = (p0[0] + nothing, p0[1] + nothing, heading, begins, k[0], force, nothing)
        _, states = jax.lax.scan(record, start, (times[:-1], times[1:]))
        return jnp.concatenate([jnp.stack(start[:6])[None], states])


def system(law: Law | None = None) -> Car:
    """The car, with what differs between its runs."""
    most = np.array([TURN, 1.0, 1.0, 1.0, 1.0])
    grid = time_grid(1.0, SHARES + 2.0, 1.0 / EVERY)
    return Car(box(-most * [1, 0, 1, 1, 1], most), grid, Law() if law is None else law)
