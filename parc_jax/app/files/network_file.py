"""Trained networks of other tools, from files, as the float64 network that is verified."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from parc_jax.common.arrays import real
from parc_jax.common.errors import InputError, reading
from parc_jax.learning.network.relu import Normalisation, ReLUNetwork, fold, relu_network
from parc_jax.learning.runs.files import read_npz


def load_network(path, normalisation: Normalisation | None = None) -> ReLUNetwork:
    """The network k -> (c_1 ... c_T, q) in a file, in float64. Raises InputError that names the
    unreadable part. Of a robot with several reference points: (c_0 without its first point, c_1 ...
    c_T, q), point by point.

    path: an .npz of arrays by the names of a PyTorch state dict, as of `from_state_dict`.
    normalisation: the network computes y_mean + y_scale * net((k - x_mean) / x_scale); it is folded
    into the weights, and the equality is checked on random inputs.
    """
    path = Path(path)
    if path.suffix != ".npz":
        raise InputError(
            f"{path}: expected a network as .npz. A state dict of torch is written by "
            "np.savez(path, **{k: v.numpy() for k, v in net.state_dict().items()}); .onnx is read "
            "by read_onnx of benchmarks.peers.onnx_network, in a clone."
        )
    return from_state_dict(read_npz(path), normalisation, str(path))


def from_state_dict(
    state: Mapping[str, np.ndarray],
    normalisation: Normalisation | None = None,
    name: str = "state dict",
) -> ReLUNetwork:
    """The network of a PyTorch state dict: linear layers in the order of their entries, ReLU
    between them.

    state: "....weight" (out, in) and "....bias" (out,) as arrays or tensors; a layer without bias
        has none. The file does not name the functions between the layers: ReLU is your word.
    Raises InputError for any other entry.
    """
    state = {key: _array(key, value, name) for key, value in state.items()}
    layers = [key.removesuffix("weight") for key in state if key.endswith("weight")]
    known = {f"{prefix}{kind}" for prefix in layers for kind in ("weight", "bias")}
    foreign = [key for key in state if key not in known]
    if foreign or not layers:
        raise InputError(
            f"{name}: expected entries ....weight and ....bias of linear layers; got "
            f"{(foreign or ['none'])[0]!r}. Batch norm and others must be folded into the layers "
            "first."
        )
    weights: list[np.ndarray] = []
    biases: list[np.ndarray] = []
    for prefix in layers:
        W = state[f"{prefix}weight"]
        b = state.get(f"{prefix}bias", np.zeros(W.shape[:1]))
        if W.ndim != 2 or b.shape != W.shape[:1]:
            raise InputError(
                f"{name}: expected {prefix}weight (out, in) and {prefix}bias (out,); got "
                f"{W.shape}, {b.shape}. Convolutions and normalisations are not linear layers."
            )
        weights, biases = [*weights, W], [*biases, b]
    return normalised(relu_network(weights, biases), normalisation)


def normalised(net: ReLUNetwork, normalisation: Normalisation | None) -> ReLUNetwork:
    """The network with scalings folded in, none where there are none. Raises InputError."""
    if normalisation is None:
        return net
    parts = {}
    for part, value in normalisation._asdict().items():
        value = np.atleast_1d(_array(part, value, "normalisation"))
        size = net.n_in if part.startswith("x") else net.n_out
        if value.shape not in ((1,), (size,)):
            raise InputError(f"normalisation: expected {part} ({size},); got {value.shape}.")
        parts[part] = np.broadcast_to(value, (size,))
    return fold(net.weights, net.biases, Normalisation(**parts))


def _array(key: str, value, name: str) -> np.ndarray:
    """A float64 array from an array or a tensor on any device."""
    value = value.detach().cpu() if hasattr(value, "detach") else value
    with reading(name, f"numbers in {key!r}"):
        return np.asarray(real(value), np.float64)
