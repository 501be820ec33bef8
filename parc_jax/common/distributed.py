"""Many devices: one mesh with one axis of rows, over which `solve_batch` splits its scenes."""

import jax

AXIS = "rows"


def mesh(devices=None) -> jax.sharding.Mesh:
    """All devices, or the given ones, in one axis; of Auto type, so code for one device works as it
    is.
    """
    devices = jax.devices() if devices is None else devices
    return jax.make_mesh(
        (len(devices),), (AXIS,), axis_types=(jax.sharding.AxisType.Auto,), devices=devices
    )
