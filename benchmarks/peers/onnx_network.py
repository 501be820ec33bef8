"""Networks in ONNX files: chains of operations, folded into the network that is verified."""

from pathlib import Path

import numpy as np

from parc_jax.app.files.network_file import normalised
from parc_jax.common.errors import InputError, SoundnessError, reading
from parc_jax.common.on_use import package
from parc_jax.learning.network.predict import outputs
from parc_jax.learning.network.relu import Normalisation, ReLUNetwork, relu_network

KNOWN = "Gemm, MatMul, Add, Sub, Mul, Div, Relu, Flatten, Identity, Dropout, Constant"
ROUNDED = 1e-4  # [of its outputs, or 1] from what onnx computes of the file, mostly in float32


def read_onnx(path: Path, normalisation: Normalisation | None = None) -> ReLUNetwork:
    """The network of an ONNX file with one input and one output, by the numbers that it stores.
    normalisation: as of `parc_jax.exchange.load_network`. Raises InputError that names the
    unreadable part, SoundnessError where onnx itself computes something else on random inputs.
    """
    onnx, reference = (package(name, "ONNX files") for name in ("onnx", "onnx.reference"))
    with reading(path, "an ONNX file", Exception):  # protobuf has errors of its kinds
        graph = (model := onnx.load(path)).graph
        array = lambda x: onnx.numpy_helper.to_array(x).astype(np.float64)  # noqa: E731
        constants = {tensor.name: array(tensor) for tensor in graph.initializer}
        inputs = [i for i in graph.input if i.name not in constants]
        sizes = [d.dim_value for i in inputs for d in i.type.tensor_type.shape.dim]
        own = {function.name for function in model.functions}
    if len(inputs) != 1 or len(graph.output) != 1 or not any(sizes[-1:]) or {*sizes[1:-1]} - {1}:
        raise InputError(f"{path}: expected one input, rows of a known size, and one output.")
    at, W, b = inputs[0].name, np.eye(sizes[-1]), np.zeros(sizes[-1])
    layers: list[tuple[np.ndarray, np.ndarray]] = []
    for node in graph.node:
        of = {a.name: onnx.helper.get_attribute_value(a) for a in node.attribute}
        known = node.domain in ("", "ai.onnx") and node.op_type not in own
        kind = node.op_type if known else f"{node.op_type} of {node.domain!r}"
        what = f"{kind} {node.name!r}"
        if kind == "Constant" and "value" in of:
            constants[node.output[0]] = array(of["value"])
            continue
        if at not in node.input:
            raise InputError(f"{path}: expected a chain; {what} does not follow {at!r}.")
        if kind == "Relu":
            layers, W, b = [*layers, (W, b)], np.eye(len(b)), 0 * b
        elif kind not in ("Identity", "Flatten", "Dropout"):
            others = [constants.get(name) for name in node.input if name != at]
            first = node.input[0] == at
            with reading(f"{path}: {what}", f"one of {KNOWN}", TypeError):
                W, b = _after(kind, of, first, others, W, b)
        at = node.output[0]
    if at != graph.output[0].name:
        raise InputError(f"{path}: expected the chain to end in its output; it ends in {at!r}.")
    net = relu_network(*map(list, zip(*layers, (W, b), strict=True)))
    x = np.random.default_rng(0).normal(size=(512, net.n_in)) * np.logspace(-2, 2, 512)[:, None]
    x = x.astype(onnx.helper.tensor_dtype_to_np_dtype(inputs[0].type.tensor_type.elem_type))
    with reading(path, "a chain that onnx computes for many rows", Exception):
        told = reference.ReferenceEvaluator(model).run(None, {inputs[0].name: x})[0]
        gap = np.abs(told - outputs(net, x)).max(axis=1) / np.fmax(1.0, np.abs(told).max(axis=1))
    if not gap.max() <= ROUNDED:
        raise SoundnessError(f"{path}: the folded network differs by {gap.max():.1e} (relative).")
    return normalised(net, normalisation)


def _after(kind: str, of: dict, first: bool, others: list, W: np.ndarray, b: np.ndarray):
    """W, b after an operation of the running value, which comes first or not. Raises ValueError."""
    if any(x is None for x in others or [None]):
        raise ValueError("it takes what is no constant of the file")
    if kind in ("Gemm", "MatMul") and first and others[0].ndim == 2 and not of.get("transA"):
        M = of.get("alpha", 1.0) * (others[0] if of.get("transB") else others[0].T)
        return M @ W, M @ b + of.get("beta", 1.0) * (others[1].ravel() if others[1:] else 0.0)
    value = np.broadcast_to(others[0].ravel(), b.shape)
    if kind == "Add" or (kind == "Sub" and first):
        return W, b + (value if kind == "Add" else -value)
    if kind == "Sub":
        return -W, value - b
    if kind == "Mul" or (kind == "Div" and first and value.all()):
        scale = value if kind == "Mul" else 1 / value
        return scale[:, None] * W, scale * b
    raise ValueError("as it stands here")
