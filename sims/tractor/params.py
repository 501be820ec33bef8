"""Numbers of the driver, of the tyres and of the ground. Lengths and masses are in tractor.xml."""

import math

STEP = 0.05  # [s] between records; five time steps of tractor.xml
PLAN_STEP = 0.4  # [s]
T_FINAL = 8.0  # [s]

WHEELBASE = 2.0  # [m] of the tractor
HITCH = 0.9  # [m] from the rear axle back to the hitch
DRAWBAR = 2.8  # [m] from the hitch back to the trailer's axle

SPEED = 1.6  # [m/s] while driving
LAUNCH, BRAKE = 1.0, 1.0  # [m/s^2] ramps of the speed asked for
STOP_AT = 7.8  # [s] speed asked for is zero from here on
SPEED_GAIN = 8000.0  # [N per m/s]
TURN_RATE = 0.45  # [rad/s] of the heading asked for
HEADING_GAIN = 2.5  # [1/s]
STEER_LIMIT = 0.7  # [rad]

GRIP = 9000.0  # [N] most that the tyres of an axle push sideways
SLIP = 0.2  # [m/s] sideways at which they push three quarters of that
HITCH_ANGLE = 0.03  # [rad] most that the trailer is not straight at the start
SLOPE = 200.0  # [N] most that the slope of the ground pulls along each axis

BEFORE_TURN = (2.0, 4.0)  # [m] driven straight before the turn
TURN = (math.pi / 3, math.pi / 2)  # [rad]

# In the yard (`yard.py`), where a manoeuvre begins while the tractor drives and carries its stop
HELD = 0.8  # [s] for which a command is held
RAMPS = (1.5, 0.6)  # [m/s^2], [rad/s] of what is asked for, from what was measured on
FAST, STEER = 2.0, 0.4  # [m/s], [rad] most that is commanded
SPEED_BEYOND = (0.1, 0.15)  # [m/s] below 0 and above FAST that such commands lead to, at most
STEER_BEYOND, HITCH_BEYOND = 0.45, 0.75  # [rad] the same, and of the hitch, either way
SERVO = 40_000.0  # [N per m/s]: what drives and brakes lags by a tenth of a second
YARD_STEP, YARD_T_F = 0.2, 2.8  # [s]
