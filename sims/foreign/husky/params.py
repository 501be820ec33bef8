"""Numbers of the robot, of its drive and of the window that is cut from it."""

COMMANDS = (-3.1373, 3.0846)  # [rad/s] each wheel speed was drawn uniformly from this box: the
# bounds are inferred from a file of the same campaign (README of the data), not written beside it
STEP = 6.0  # [s] that a command was held
STEADY = 2.0  # [s] after which the robot follows its command, whatever it did before
T_FINAL = STEP - STEADY  # [s]
PLAN_STEP = 0.4  # [s] between knots of the model
RECORD = 0.1  # [s] between records; the poses come at 10 Hz

LENGTH, WIDTH = 0.84, 0.66  # [m] footprint, bumpers left away; taken to be centred on the pose

POSE_NOISE = 0.02  # [m] floor of the profile: a pose is up to 25 ms late, at up to 0.5 m/s

STICKING = 0.15  # [rad/s] a wheel commanded slower than this may stick, or be dragged along by
# the ground: half as much again as the fastest such command among the training ones
STRIPS_WIDER = 20.0  # [1] profile there, relative to elsewhere: nothing is planned there
