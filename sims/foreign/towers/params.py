"""Numbers of the flight and of the pilot. The aeroplane's own are JSBSim's (c172p)."""

MODEL = "c172p"
STEP = 1 / 120  # [s] of JSBSim
RECORD = 0.1  # [s] between records; twelve steps
PLAN_STEP = 0.5  # [s]
T_FINAL = 20.0  # [s]

LATITUDE, LONGITUDE = 47.0, 8.0  # [deg] of the map's origin
ALTITUDE = 300.0  # [m] above the sea at the start
AIRSPEED = 55.0  # [m/s] calibrated, trimmed at the start
HEADING = -35.0  # [deg] of the map at the start: from its x axis (east) towards its y axis (north)

WIND = (3.0, 1.0)  # [m/s] mean, towards north and east
TURBULENCE = 3  # JSBSim's turb-type: the spectra of MIL-F-8785C
SURFACE_WIND = 15.0  # [ft/s] at 20 ft, which sets the turbulence below 1,000 ft
SEVERITY = 3  # of the turbulence above 2,000 ft, from 1 to 7

TURN_AT = 1.0  # [s] the pilot starts to bank
PITCH_IN = 2.0  # [s] over which the pitch asked for grows
ROLL_GAIN, ROLL_DAMPING = 2.0, 0.7  # aileron per rad, per rad/s
PITCH_GAIN, PITCH_DAMPING, PITCH_INTEGRAL = 3.0, 1.0, 1.0  # elevator per rad, rad/s, rad s

BANK = (20.0, 35.0)  # [deg] to the left
PITCH = (2.0, 5.0)  # [deg] above the trimmed one
BANKED = (5.0, 8.0)  # [s]

# Places on the aeroplane (forward, right, down) [m] from its centre of gravity: tip of the nose,
# wing tips, ends of the tailplane. ROUND is the radius that covers chords and the rudder.
NOSE = (2.0, 0.0, 0.25)
LEFT_WING, RIGHT_WING = (-0.06, -5.46, -0.58), (-0.06, 5.46, -0.58)
LEFT_TAIL, RIGHT_TAIL = (-5.6, -1.2, -0.2), (-5.6, 1.2, -0.2)
ROUND = 0.6  # [m]
