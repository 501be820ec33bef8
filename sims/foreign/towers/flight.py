"""The black box: one flight of JSBSim's Cessna 172P, in turbulence. JSBSim is not ours; this file
starts it, flies it and reads it, and is all that knows it.
"""

import os

import numpy as np

from sims.foreign.towers import chart
from sims.foreign.towers import params as c
from sims.foreign.towers.pilot import Pilot

FOOT = 0.3048  # [m]
KNOT = 0.514444  # [m/s]
WHERE = ("position/ecef-x-ft", "position/ecef-y-ft", "position/ecef-z-ft")
ANGLES = ("attitude/phi-rad", "attitude/theta-rad", "attitude/psi-rad")
PLACE = ("position/lat-geod-rad", "position/long-gc-rad", "position/h-sl-ft")
POINTS = ("nose", "left wing", "left tail", "right tail", "right wing")
ARMS = np.array([c.NOSE, c.LEFT_WING, c.LEFT_TAIL, c.RIGHT_TAIL, c.RIGHT_WING])


def fly(rng: np.random.Generator, k) -> tuple[np.ndarray, np.ndarray]:
    """A flight from the origin of the map. k = (bank to the left [deg], pitch [deg], time banked
    [s]) -> p (201, 5, 2) [m] of POINTS, seen from above, q = (climb [m],).
    """
    return fly_from(rng, k, np.zeros(2))


def fly_from(rng: np.random.Generator, k, p0) -> tuple[np.ndarray, np.ndarray]:
    """The same flight from p0 (2,) [m] on the map. The turbulence is drawn from `rng`."""
    aeroplane = trimmed(p0, c.ALTITUDE)
    stir(aeroplane, int(rng.integers(2**31 - 1)))
    rows = flown(aeroplane, k)
    return points(rows), rows[-1:, 5] * FOOT - c.ALTITUDE


def trimmed(p0, altitude: float):
    """A fresh simulation, in trimmed level flight over p0 (2,) [m] at an altitude [m], in calm air.

    Fresh for every run: one that has flown before, reset and trimmed again, flies another flight.
    """
    os.environ.setdefault("JSBSIM_DEBUG", "0")  # else a banner for every flight
    from jsbsim import FGFDMExec

    latitude, longitude, north = chart.place_of(p0)
    aeroplane = FGFDMExec(None)
    aeroplane.set_debug_level(0)
    aeroplane.load_model(c.MODEL)
    aeroplane.set_dt(c.STEP)
    aeroplane["ic/lat-geod-deg"] = np.degrees(latitude)
    aeroplane["ic/long-gc-deg"] = np.degrees(longitude)
    aeroplane["ic/h-sl-ft"] = altitude / FOOT
    aeroplane["ic/vc-kts"] = c.AIRSPEED / KNOT
    aeroplane["ic/psi-true-deg"] = (90.0 - c.HEADING + np.degrees(north)) % 360.0
    aeroplane["ic/gamma-deg"] = 0.0
    if not aeroplane.run_ic():
        raise RuntimeError("JSBSim refuses the initial conditions")
    aeroplane["propulsion/set-running"] = -1
    aeroplane["fcs/mixture-cmd-norm"] = 0.9
    aeroplane["fcs/throttle-cmd-norm"] = 0.9
    aeroplane.do_trim(1)
    aeroplane["fcs/throttle-cmd-norm"] = 1.0
    return aeroplane


def stir(aeroplane, seed: int) -> None:
    """Wind and turbulence from here on."""
    aeroplane["simulation/randomseed"] = seed
    aeroplane["atmosphere/randomseed"] = seed
    aeroplane["atmosphere/turb-type"] = c.TURBULENCE
    aeroplane["atmosphere/turbulence/milspec/windspeed_at_20ft_AGL-fps"] = c.SURFACE_WIND
    aeroplane["atmosphere/turbulence/milspec/severity"] = c.SEVERITY
    aeroplane["atmosphere/wind-north-fps"] = c.WIND[0] / FOOT
    aeroplane["atmosphere/wind-east-fps"] = c.WIND[1] / FOOT


def flown(aeroplane, k) -> np.ndarray:
    """Rows (201, 9), one a record: roll, pitch, yaw [rad], latitude, longitude [rad], altitude
    [ft], place [ft] in axes fixed to the earth.
    """
    read = aeroplane.get_property_value
    write = aeroplane.set_property_value
    pilot = Pilot(k, read("attitude/theta-rad"))
    names = (*ANGLES, *PLACE, *WHERE)
    every = round(c.RECORD / c.STEP)
    steps = round(c.T_FINAL / c.STEP)
    rows = [[read(name) for name in names]]
    for step in range(1, steps + 1):
        rates = read("velocities/p-rad_sec"), read("velocities/q-rad_sec")
        aileron, elevator = pilot.stick(
            step * c.STEP, read("attitude/phi-rad"), read("attitude/theta-rad"), *rates
        )
        write("fcs/aileron-cmd-norm", aileron)
        write("fcs/elevator-cmd-norm", elevator)
        if not aeroplane.run():
            raise RuntimeError(f"JSBSim stopped at {step * c.STEP:.2f} s")
        if step % every == 0:
            rows.append([read(name) for name in names])
    return np.array(rows)


def points(rows: np.ndarray) -> np.ndarray:
    """Map coordinates (n, 5, 2) [m] of POINTS at rows (n, 9) of `flown`."""
    local = chart.north_east_down(rows[:, 3], rows[:, 4])
    turned = chart.body_axes(*rows[:, :3].T)
    arms = np.einsum("nia,nij,pj->npa", local, turned, ARMS)
    return chart.on_map(rows[:, None, 6:] * FOOT + arms)
