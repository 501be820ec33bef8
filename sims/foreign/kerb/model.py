"""The black box: the multi-body car of commonroad-vehicle-models. Its functions are not ours and
stay as they are; where numba is installed they are compiled, else they run as Python, slowly.
"""

import dataclasses
import functools
import types
from collections import namedtuple
from collections.abc import Callable

import numpy as np


def compiler() -> Callable:
    """What compiles a function: numba's njit, or nothing."""
    try:
        from numba import njit
    except ImportError:
        return lambda function: function
    return njit(nogil=True)


@functools.cache
def right_hand_side() -> Callable:
    """f(x (29,), u (2,), parameters) -> list of 29 derivatives. It changes its x: pass a copy."""
    from vehiclemodels.utils import acceleration_constraints as acceleration
    from vehiclemodels.utils import steering_constraints as steering
    from vehiclemodels.utils import tire_model
    from vehiclemodels.utils import vehicle_dynamics_ks_cog as slow
    from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb

    build = compiler()
    limits = {
        "steering_constraints": build(steering.steering_constraints),
        "acceleration_constraints": build(acceleration.acceleration_constraints),
    }
    tyres = types.ModuleType("tire_model")  # compiled code reads functions from modules alone
    sign = build(tire_model.sign)
    for name in (
        "formula_longitudinal",
        "formula_lateral",
        "formula_longitudinal_comb",
        "formula_lateral_comb",
    ):
        setattr(tyres, name, build(_with(getattr(tire_model, name), sign=sign)))
    stopping = build(_with(slow.vehicle_dynamics_ks_cog, **limits))
    others = limits | {"vehicle_dynamics_ks_cog": stopping, "tireModel": tyres}
    return build(_with(vehicle_dynamics_mb, **others))


def _with(function: Callable, **compiled) -> Callable:
    """The same code, where the functions that it calls by these names are the compiled ones."""
    space = function.__globals__ | compiled
    return types.FunctionType(function.__code__, space, function.__name__)


@functools.cache
def standard():
    """The BMW's parameters as nested named tuples of floats, which can be compiled."""
    from vehiclemodels.parameters_vehicle2 import parameters_vehicle2

    return _frozen(parameters_vehicle2())


def _frozen(record):
    """A dataclass as a named tuple of those of its fields that have a value."""
    values = {}
    for field in dataclasses.fields(record):
        value = getattr(record, field.name)
        if dataclasses.is_dataclass(value):
            value = _frozen(value)
        if value is not None:
            values[field.name] = value if isinstance(value, tuple) else float(value)
    return namedtuple(type(record).__name__, values)(**values) if values else None


def changed(friction: float, load: float):
    """The parameters with other friction of the tyres and another mass of the body, as factors; its
    moments of inertia and the height that the springs are set for go with the mass.
    """
    p = standard()
    tyre = p.tire._replace(p_dx1=friction * p.tire.p_dx1, p_dy1=friction * p.tire.p_dy1)
    axles = p.m_uf + p.m_ur
    return p._replace(
        tire=tyre,
        m_s=load * p.m_s,
        m=load * p.m_s + axles,
        I_Phi_s=load * p.I_Phi_s,
        I_y_s=load * p.I_y_s,
        I_z=load * p.I_z,
    )


def rolling(place, heading: float, speed: float, parameters) -> np.ndarray:
    """State (29,) of the car rolling straight ahead on level ground at a place (2,) [m]."""
    from vehiclemodels.init_mb import init_mb

    core = [float(place[0]), float(place[1]), 0.0, speed, heading, 0.0, 0.0]
    return np.array(init_mb(core, parameters), np.float64)
