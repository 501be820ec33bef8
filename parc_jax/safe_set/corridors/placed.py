"""A model and a scene where kernels find them: on the device, once for all queries about them."""

import jax

from parc_jax.common import struct
from parc_jax.common.arrays import once, x64
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.safe_set.corridors.sampling import BinEnds, ends_of
from parc_jax.safe_set.verdict.pointwise import end_network
from parc_jax.safe_set.verdict.scene import OneScene, Scene
from parc_jax.safe_set.verdict.sized import ROOM, roomy


@struct.dataclass
class Placed:
    """A question on the device.

    end: the network with the outputs of the last knot only. scene: with room for more obstacles.
    ends: the bins and where their plans may end. at: (n_p,) [m] the one start of all
    plans, None for any.
    """

    net: ReLUNetwork
    end: ReLUNetwork
    tube: Tube
    scene: OneScene
    ends: BinEnds
    at: jax.Array | None


def placed(scene: Scene) -> Placed:
    """The question on the device that JAX is set to. Moved there once while the scene lives."""
    return once(scene, _placed, jax.config.jax_default_device)


def _placed(scene: Scene, device: jax.Device | None) -> Placed:
    about = once(scene.model, _of_model, device)
    corners_of_a_box = 2**scene.model.n_p
    own = (roomy(scene, ROOM, corners_of_a_box).arrays, ends_of(scene), scene.at)
    with x64(), jax.transfer_guard_host_to_device("allow"):
        return Placed(*about, *_moved(own))


@jax.jit
def _moved(tree: tuple):
    """The same arrays on the device, in one call: `device_put` takes three times as long."""
    return tree


def _of_model(model: TrajectoryModel, _device: jax.Device | None):
    with x64():
        return jax.device_put((model.net, end_network(model), model.tube))
