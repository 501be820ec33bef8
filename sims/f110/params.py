"""Numbers of the car, its driver and the recording. The masses, lags and torques of the car are in
f110.xml.
"""

import math

WHEELBASE = 0.33  # [m]
TRACK = 0.26  # [m] between the middles of the tyres
WHEEL_RADIUS = 0.05  # [m]
BODY_LENGTH, BODY_WIDTH = 0.57, 0.30  # [m] over everything, for collisions
WHEELS = ("front_left", "front_right", "rear_left", "rear_right")

T_FINAL = 4.9  # [s]
PLAN_STEP = 0.1  # [s]
TICKS_PER_PLAN_STEP = 12  # motion capture and driver run at 120 Hz
TICK = PLAN_STEP / TICKS_PER_PLAN_STEP  # [s]
SUBSTEPS = 2  # physics steps per tick; f110.xml has half a tick as its time step

LINE_RANGE = (-1.9, -1.0)  # [m] y of the line to follow, seen from the start
SPEED_RANGE = (2.0, 3.25)  # [m/s]

# Following the line, until the car is seen past SWITCH_X
SWITCH_X = 4.5  # [m]
APPROACH_RATE, APPROACH_LIMIT = (
    1.5,
    0.7,
)  # [1/s], [rad] heading asked for: towards the line at this rate
APPROACH_ACCELERATION = 0.9  # [m/s^2] sideways, for turning onto the line
LINE_INTEGRAL, LINE_LIMIT = 0.3, 0.05  # [rad/(m s)], [rad]
HEADING_RATE, YAW_RATE_GAIN = 6.0, 0.6  # [1/s], [1]
TURN_ACCELERATION = 2.5  # [m/s^2] no more than this sideways: the tyres hold 3.5
STEER_LIMIT = 0.45  # [rad]
LAUNCH = 1.25  # [m/s^2] ramp of the speed asked for; bare grip allows 1.7
SPEED_GAIN, SPEED_INTEGRAL, SPEED_LIMIT = 0.8, 1.0, 0.5  # [1], [1/s], [m/s]
WHEELSPIN = 0.45  # [m/s] wheels at most this much faster than the car: the launch stays a launch
VELOCITY_FILTER = 0.2  # weight of the newest difference of two motion-capture poses

# The open loop after it; time counts from the switch
LOCK_UNTIL = 0.34  # [s] rear wheels locked while the front wheels steer in: the tail breaks away
POWER_UNTIL, POWER_PER_SPEED = (
    0.91,
    -0.14,
)  # [s], [s per m/s above 2 m/s] rear wheels spin: the car turns about
POWER_SPEED = 3.5  # [m/s] of the spinning wheels; after that all four lock until the end
DRIFT_STEER, END_STEER = 0.30, 0.45  # [rad] while turning about, and after it

GAP = 1.2  # [m] between the parked cars
BODY_RADIUS = 0.5 * math.hypot(BODY_LENGTH, BODY_WIDTH)  # [m] circle about the car's middle
