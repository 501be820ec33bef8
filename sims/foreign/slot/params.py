"""Numbers of the manoeuvre, of its pilot and of what disturbs it; the drone's are crazyflow's."""

import math

SPEED = (1.2, 2.4)  # [m/s] asked for while approaching
BANK = (0.8, 1.3)  # [rad] roll asked for at the slot
SHIFT = (-0.03, 0.03)  # [s] by which the roll begins later

STEP = 0.01  # [s] between records, and between two commands of the pilot
PLAN_STEP = 0.05  # [s]
T_FINAL = 3.0  # [s]
HEIGHT = 100.0  # [m] of the start above crazyflow's floor, which clips what falls below it

SIZE = (0.14, 0.14, 0.04)  # [m] of crazyflow's box for contacts, along, across and up
GRAVITY = 9.81  # [m/s^2]
INCLINE = math.pi / 3  # [rad] of the slot, and so of the direction that the pilot holds

SPEED_UP = 0.6  # [s]
ROLL_AT = 0.9  # [s] at which the roll begins, but for the shift
ROLL_FOR = 0.28  # [s]
STOP_AFTER = 1.4  # [m] behind the place of the roll
STIFFNESS, DAMPING = 20.0, 8.0  # [1/s^2], [1/s] about the way
ACROSS_STIFFNESS, ACROSS_DAMPING = 12.0, 25.0  # [1/s^2], [1/s] across the slot during the roll
MOST = 8.0  # [m/s^2] asked for along any axis
LEAST_THRUST = 0.3  # [weights] with none, crazyflow's controller gives up the attitude as well
OBSERVER = 10.0  # [1/s] at which the pilot learns what pulls at the drone

FORCE = 0.007  # [weights] standard deviation along each axis, one for a run
MASS = 0.006  # [1] most that the mass is off, and
INERTIA = 0.015  # [1] most that each moment of inertia is, drawn for each run
