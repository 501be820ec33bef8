"""Networks trained elsewhere: .npz, ONNX, PyTorch state dicts. Linear layers and ReLU,
normalisation folded.
"""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from parc_jax.app.files.chain import Linear, Relu, fold_chain
from parc_jax.app.files.onnx_read import read_onnx
from parc_jax.common.errors import InputError
from parc_jax.learning.network.relu import Normalisation, ReLUNetwork, fold
from parc_jax.learning.runs.files import read_npz

SCALINGS = ("x_mean", "x_scale", "y_mean", "y_scale")


def load_network(path, normalisation: Normalisation | None = None) -> ReLUNetwork:
    """The network k -> (c_1 ... c_T, q) in a file, in float64. Raises InputError that says what
    cannot be read. Of a robot with several reference points: (c_0 without its first point, c_1 ...
    c_T, q), point by point.

    *.npz       W0, b0, W1, b1, ... with W (out, in); or the names of a PyTorch state dict. May hold
                x_mean, x_scale, y_mean, y_scale.
    *.onnx      a chain of Gemm, MatMul, Add, Sub, Mul, Div, Relu, Flatten, Identity; needs the
    package onnx. *.pt, *.pth a state dict (torch.save(net.state_dict(), path)); needs torch.
    normalisation: the network computes y_mean + y_scale * net((k - x_mean) / x_scale); it is folded
    into the weights, and the equality is checked on random inputs.
    """
    path = Path(path)
    if path.suffix == ".onnx":
        return _normalised(read_onnx(path), normalisation)
    if path.suffix in (".pt", ".pth"):
        return from_state_dict(_torch_state(path), normalisation, str(path))
    if path.suffix != ".npz":
        raise InputError(f"{path}: expected a network as .npz, .onnx, .pt or .pth.")
    arrays = read_npz(path)
    scalings = {name: arrays.pop(name) for name in SCALINGS if name in arrays}
    if scalings:
        if set(scalings) != set(SCALINGS) or normalisation is not None:
            raise InputError(
                f"{path}: expected all of {', '.join(SCALINGS)}, once; got {', '.join(scalings)}."
            )
        normalisation = Normalisation(**scalings)
    if "W0" in arrays:
        layers = sum(re.fullmatch(r"W\d+", name) is not None for name in arrays)
        missing = [n for i in range(layers) for n in (f"W{i}", f"b{i}") if n not in arrays]
        if missing:
            raise InputError(
                f"{path}: expected arrays W0, b0, ... W{layers - 1}, b{layers - 1}; no "
                f"{missing[0]}."
            )
        arrays = {
            f"{i}.{kind}": arrays[f"{short}{i}"] for i in range(layers) for kind, short in _KINDS
        }
    return from_state_dict(arrays, normalisation, str(path))


def from_state_dict(
    state: Mapping[str, np.ndarray],
    normalisation: Normalisation | None = None,
    name: str = "state dict",
) -> ReLUNetwork:
    """The network of a PyTorch state dict: linear layers in the order of their entries, ReLU
    between them.

    state: "....weight" (out, in) and "....bias" (out,) as arrays or tensors; a layer without bias
        has none. The
    file does not say what lies between the layers: ReLU is your word. Raises InputError for any
    other entry.
    """
    state = {key: _array(key, value, name) for key, value in state.items()}
    layers = [key.removesuffix("weight") for key in state if key.endswith("weight")]
    foreign = [key for key in state if not key.endswith(("weight", "bias"))]
    if foreign or not layers:
        raise InputError(
            f"{name}: expected entries ....weight and ....bias of linear layers; got "
            f"{(foreign or ['none'])[0]!r}. "
            "Batch norm and others must be folded into the layers first."
        )
    chain: list = []
    for prefix in layers:
        W = state[f"{prefix}weight"]
        b = state.get(f"{prefix}bias", np.zeros(W.shape[:1]))
        if W.ndim != 2 or b.shape != W.shape[:1]:
            raise InputError(
                f"{name}: expected {prefix}weight (out, in) and {prefix}bias (out,); got "
                f"{W.shape}, {b.shape}. "
                "Convolutions and normalisations are not linear layers."
            )
        chain += [Linear(W, b), Relu()]
    return _normalised(fold_chain(chain[:-1], name), normalisation)


def _normalised(net: ReLUNetwork, normalisation: Normalisation | None) -> ReLUNetwork:
    if normalisation is None:
        return net
    parts = {
        part: np.atleast_1d(np.asarray(v, np.float64))
        for part, v in normalisation._asdict().items()
    }
    for part, value in parts.items():
        wanted = net.n_in if part.startswith("x") else net.n_out
        if value.shape not in ((1,), (wanted,)):
            raise InputError(f"normalisation: expected {part} ({wanted},); got {value.shape}.")
        parts[part] = np.broadcast_to(value, (wanted,))
    return fold(net.weights, net.biases, Normalisation(**parts))


def _array(key: str, value, name: str) -> np.ndarray:
    """A float64 array from an array or a tensor on any device."""
    value = value.detach().cpu() if hasattr(value, "detach") else value
    try:
        return np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise InputError(
            f"{name}: expected numbers in {key!r}; got {type(value).__name__}."
        ) from None


def _torch_state(path: Path) -> Mapping:
    try:
        import torch
    except ImportError:
        raise InputError(
            f"{path}: reading it needs torch, which is not installed. Save the arrays as .npz: "
            "np.savez(path, **{k: v.numpy() for k, v in net.state_dict().items()})."
        ) from None
    try:
        state = torch.load(path, map_location="cpu", weights_only=True)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file.") from None
    except Exception as error:  # torch raises whatever its unpickler meets
        raise InputError(
            f"{path}: expected a state dict of tensors; {type(error).__name__}: {error!s:.200}"
        ) from None
    if not isinstance(state, Mapping):
        raise InputError(
            f"{path}: expected a state dict; got {type(state).__name__}. Save net.state_dict()."
        )
    return state


_KINDS = (("weight", "W"), ("bias", "b"))
