"""Numbers of the drive, of the driver and of what differs between runs. The car's own are those of
commonroad-vehicle-models (vehicle 2, a BMW 320i).
"""

STEP = 1e-3  # [s] of the integration
RECORD = 0.02  # [s] between records
PLAN_STEP = 0.2  # [s]
T_FINAL = 4.0  # [s]
STOP = 0.3  # [m/s] below it the brake holds the car; at 0.1 the model becomes another one

LENGTH, WIDTH = 4.508, 1.61  # [m] of the outline, as in the package's parameters
WHEELBASE = 2.579  # [m] that the driver believes in

SPEED = (6.0, 8.0)  # [m/s] at the start
TURN = (0.3, 0.35)  # [rad] most that the car turns towards the kerb

AHEAD = 1.0  # [m] driven before the swerve
SWERVE = 14.0  # [m] of it
AFTER = 0.5  # [m] from its end to where the car should stand
BRAKING = 4.0  # [m/s^2] planned
HARDEST = 8.0  # [m/s^2] most asked for
SPEED_GAIN = 4.0  # [1/s]
HEADING_GAIN, RATE_GAIN = 1.0, 0.05  # steering angle per rad, per rad/s
LATERAL_GAIN, LATERAL_MOST = 0.15, 0.1  # heading asked for per metre beside the way, its limit
STEERING_GAIN = 20.0  # [1/s] of the steering motor, which the model limits to 0.4 rad/s

# What differs from run to run, each uniform in plus or minus so much
FRICTION = (-0.15, 0.05)  # change of the tyres' friction, as a share
LOAD = 0.05  # of mass and inertia of the body, as a share
SPEED_OFF = 0.1  # [m/s] at the start
HEADING_OFF = 0.009  # [rad] at the start
STEERING_OFF = 0.005  # [rad] of the steering's zero
BRAKES_OFF = 0.05  # of the brakes, as a share
