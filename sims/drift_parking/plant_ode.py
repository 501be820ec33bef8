"""The rigid body in closed form."""

from sims.drift_parking import params as c


def newton_euler(z, cos_yaw, sin_yaw, wrench):
    """Body-frame (ax, ay) [m/s^2] and yaw acceleration [rad/s^2]: force over mass, moment over
    inertia.
    """
    del z, cos_yaw, sin_yaw
    return wrench.fx / c.MASS, wrench.fy / c.MASS, wrench.moment / c.YAW_INERTIA
