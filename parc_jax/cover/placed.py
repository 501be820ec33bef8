"""A model and a scene where kernels find them: on the device, once for all queries about them."""

import jax
import numpy as np
from flax import struct

from parc_jax.arrays import remembered, x64
from parc_jax.claim.tube import Tube
from parc_jax.cover.ends import BinEnds, ends_of
from parc_jax.model import TrajectoryModel
from parc_jax.network.relu import ReLUNetwork
from parc_jax.verdict.scene import Scene
from parc_jax.verdict.screen import KNOTS, few_outputs
from parc_jax.verdict.sized import roomy


@struct.dataclass
class Placed:
    """A question on the device.

    few, knots: the network with the outputs of some knots only. scene: with room for more
    obstacles. ends: the bins and where their plans may end. at: (n_p,) [m] the one start of all
    plans, None for any.
    """

    net: ReLUNetwork
    few: ReLUNetwork
    knots: jax.Array
    tube: Tube
    scene: Scene
    ends: BinEnds
    at: jax.Array | None


def placed(model: TrajectoryModel, scene: Scene) -> Placed:
    """The question on the device that JAX is set to. Moved there once while the scene lives."""
    name = ("placed", id(model), jax.config.jax_default_device)
    return remembered(scene, name, lambda: (_placed(model, scene), model))[0]


def _placed(model: TrajectoryModel, scene: Scene) -> Placed:
    n_knots = KNOTS[type(scene.obstacles)]
    about = remembered(
        model, ("placed", n_knots, jax.config.jax_default_device), lambda: _of_model(model, n_knots)
    )
    far = np.float64(np.inf) if scene.beyond is None else scene.beyond
    padded = roomy(scene).replace(directions=None, problem=None, apart=None, at=None, beyond=far)
    own = (padded, ends_of(model.tube, scene), scene.at)
    with x64(), jax.transfer_guard_host_to_device("allow"):
        return Placed(*about, *_moved(own))


@jax.jit
def _moved(tree):
    """The same arrays on the device, in one call: `device_put` takes three times as long."""
    return tree


def _of_model(model: TrajectoryModel, n_knots: int):
    few, knots = few_outputs(model, n_knots)
    with x64():
        return jax.device_put((model.net, few, knots, model.tube))
