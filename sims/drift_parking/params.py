"""Constants of the drift-parking car. SI units, radians."""

import math

MASS = 1450.0  # [kg]
YAW_INERTIA = 2300.0  # [kg m^2]
WHEELBASE = 2.4  # [m]
FRONT_ARM = 0.67 * WHEELBASE  # centre of mass to front axle [m]
REAR_ARM = WHEELBASE - FRONT_ARM  # [m]
GRAVITY = 9.81  # [m/s^2]
FRICTION = 1.1
STIFFNESS_FRONT = 60_000.0  # cornering stiffness [N/rad]
STIFFNESS_REAR = 160_000.0
GRIP_FRONT = FRICTION * MASS * GRAVITY * REAR_ARM / WHEELBASE  # largest tyre force [N]
GRIP_REAR = FRICTION * MASS * GRAVITY * FRONT_ARM / WHEELBASE

STEER_MAX = math.radians(38.0)
STEER_STEP = math.radians(
    1.0
)  # largest steering change per evaluation of the right-hand side, not per step
DRIVE_MAX = min(GRIP_REAR - 1.0, 7684.0)  # rear drive force [N]
BRAKE_MAX = min(GRIP_FRONT - 1.0, 7684.0)  # front brake force [N]

STEP = 0.01  # integration and record step h [s]
PLAN_STEP = 0.1  # plan and controller step T [s]
T_FINAL = 7.8  # [s]
N_RECORD = 780  # record steps in T_FINAL

SPEED_RANGE = (9.0, 11.0)  # k[0]: speed that shapes the plan [m/s]
SIDESLIP_RANGE = (math.pi / 6, 2 * math.pi / 9)  # k[1]: sideslip at which braking starts [rad]

SWITCH_LATEST = 380  # last admissible switching sample (3.8 s)
SWITCH_RUN = 10  # consecutive samples beyond the threshold that fire the switch
BRAKE_STEPS = 400  # the braking phase lasts 4 s

BODY_LENGTH, BODY_WIDTH = 4.267, 1.988  # [m]
