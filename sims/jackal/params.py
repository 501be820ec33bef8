"""Numbers of the robot, its controller, its manoeuvre and what differs between runs.

Sources: [urdf] jackal_description/urdf/jackal.urdf.xacro and [control] jackal_control/config/
control.yaml of Clearpath's repository jackal/jackal (BSD); [barn] the challenge's page. The others
are ours. Masses, inertias and the tyres are in jackal.xml.
"""

WHEEL_RADIUS = 0.098  # [m] [urdf]
WHEELBASE = 0.262  # [m] between the axles [urdf]
TRACK = 0.37559  # [m] between the middles of the tyres [urdf]
WHEELS = ("front_left", "front_right", "rear_left", "rear_right")
SIDES = (-1.0, 1.0, -1.0, 1.0)  # of WHEELS: the right ones turn faster to the left

# [m] over chassis and wheels of jackal.xml, as contacts count in the challenge, whose costmap has
# 0.42 x 0.33 m, the chassis alone; over all that Clearpath builds on
SIZES = {"rectangle": (0.458, 0.416), "outside": (0.508, 0.430)}

# The velocity controller: a command (v, w) becomes four wheel speeds
TRACK_FACTOR = 1.5  # wheel_separation_multiplier: a skidding robot turns as one this much wider
MOST = (2.0, 4.0)  # [m/s], [rad/s] limits of the command [control]
MOST_CHANGE = (20.0, 25.0)  # [m/s^2], [rad/s^2] limits of its change [control]
TICK = 0.02  # [s] of the controller, which runs at 50 Hz [control]
SUBSTEPS = 8  # physics steps per tick; jackal.xml has an eighth of a tick as its time step

# The manoeuvre: measured speeds v0, w0 at the start, a command held, then a stop
MOVING = 0.3  # [s] for which the command is held
T_FINAL = 1.2  # [s] at the end of which it rests: the ramp from 2 m/s takes 0.67 s
PLAN_STEP = 0.1  # [s]
RAMP = (3.0, 6.0)  # [m/s^2], [rad/s^2] asked for: well within what the tyres hold, 4.9 m/s^2
SPEED, TURNING = 2.0, 1.5  # [m/s], [rad/s] most that is commanded
SPEED_BEYOND = (0.1, 0.1)  # [m/s] below 0 and above SPEED that such commands lead to, at most
TURNING_BEYOND = 4 / 3  # factor on TURNING: what such commands lead to, at most

# The running start: what was driven before it
RUN_IN = 0.5  # [s] of the drive before
LAST = 0.4  # [s] for which the last command before was under way, at most
SLIPPED = (0.05, 1 / 3)  # share of a command by which speeds may differ from it for long
LAG = (0.05, 0.03)  # [s] by which the speeds follow the set point, roughly

# The quick twin
TWIN_LAG = (0.06, 0.03)  # [s]
TWIN_DRIFT = 0.11  # [s] sideways speed, outwards, per m/s of speed and rad/s of turning

# Sensors
SENSED = (0.02, 0.02)  # [m/s], [rad/s] measured speeds are off by at most
GYRO_BIAS = 0.005  # [rad/s] at most, for an episode: the drift of the simulated sensor
GYRO_NOISE = 0.005  # [rad/s], standard deviation of a tick

# Dead reckoning, calibrated on random drives (`python -m sims.jackal.drift`): tyres slip by as much
# as they pull, along by the change of speed, outwards by what holds the robot in its turn
SLIP_ALONG = 0.039  # [s] by which the robot follows its wheels
SLIP_OUTWARDS = 0.066  # [m/s] per m/s of speed and rad/s of turning
# What a cycle of 0.2 s is allowed to add to its error, ahead [m], aside [m] and of the heading
# [rad]: always; per m/s, per rad/s and per both of the faster of its two ends; per m/s by which its
# wheels slipped on average, and by which the worst slid faster than GRIPS [m/s], from where on a
# tyre pulls no more. What slipped in the cycle before still comes back, so it counts too
GRIPS = 0.16
DRIFT = (
    (0.0008, 0.0006, 0.0022),
    (0.0035, 0.001, 0.0),
    (0.0, 0.0007, 0.0),
    (0.0, 0.006, 0.0),
    (0.028, 0.0, 0.0),
    (0.07, 0.08, 0.0),
)
STANDS = 0.01  # [rad/s] a wheel that is slower stands, says its encoder
# [m], [m], [rad] of a cycle in which all wheels stood, and of one that follows such a cycle
DRIFT_STOOD = ((0.0003, 0.0003, 0.0008), (1e-5, 1e-5, 1e-5))
DRIFT_TICK = (0.004, 0.001)  # [m], [rad] of any tick: the most in 30,000 was 0.0030 and 0.0005
