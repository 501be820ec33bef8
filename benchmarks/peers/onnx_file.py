"""Networks in ONNX files: each a chain of operations, folded into the float64 network that is
verified.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from parc_jax.app.files.network_file import normalised
from parc_jax.common.errors import InputError, SoundnessError, reading
from parc_jax.common.on_use import package
from parc_jax.learning.network.predict import outputs
from parc_jax.learning.network.relu import (
    FOLD_RELATIVE,
    Normalisation,
    ReLUNetwork,
    relu_network,
)

KNOWN = "Gemm, MatMul, Add, Sub, Mul, Div, Relu, Flatten, Identity, Dropout, Constant"
_PASSING = ("Identity", "Flatten", "Dropout")


class Linear(NamedTuple):
    """y = W x + b. W (out, in), b (out,)."""

    W: np.ndarray
    b: np.ndarray


class Scale(NamedTuple):
    """y = factor * x + offset, entry by entry; both (n,) or ()."""

    factor: np.ndarray
    offset: np.ndarray


class Relu(NamedTuple):
    """y = max(x, 0)."""


def apply(chain: list, x: np.ndarray) -> np.ndarray:
    """The chain as it is written, in float64, on inputs (b, n_in)."""
    for step in chain:
        if isinstance(step, Relu):
            x = np.maximum(x, 0)
        elif isinstance(step, Scale):
            x = step.factor * x + step.offset
        else:
            x = x @ step.W.T + step.b
    return x


def fold_chain(chain: list, name: str) -> ReLUNetwork:
    """The ReLU network equal to the chain; scalings before, between and after the layers are folded
    into them.

    The equality is checked on random inputs of several sizes before the network is returned. name:
    of the file, for messages. Raises InputError for a chain that is no network of linear layers and
    ReLU, SoundnessError if the check fails.
    """
    first = next((step for step in chain if isinstance(step, Linear)), None)
    if first is None:
        raise InputError(f"{name}: expected a network with at least one linear layer; found none.")
    n_in = first.W.shape[1]
    weights: list[np.ndarray] = []
    biases: list[np.ndarray] = []
    W, b = np.eye(n_in), np.zeros(n_in)
    fresh = True  # nothing but the identity since the last ReLU
    for step in chain:
        if isinstance(step, Relu):
            if fresh and weights:
                continue  # max(max(x, 0), 0)
            weights, biases, fresh = [*weights, W], [*biases, b], True
            W, b = np.eye(len(b)), np.zeros(len(b))
            continue
        fresh = False
        with reading(name, "each layer to fit the one before it"):
            if isinstance(step, Scale):
                factor, offset = (np.broadcast_to(v, b.shape) for v in step)
                W, b = factor[:, None] * W, factor * b + offset
            else:
                W, b = step.W @ W, step.W @ b + step.b
    net = relu_network([*weights, W], [*biases, b])
    x = np.random.default_rng(0).normal(size=(512, n_in)) * np.logspace(-2, 2, 512)[:, None]
    expected, got = apply(chain, x), outputs(net, x)
    gap = (np.abs(expected - got).max(axis=1) / np.maximum(1.0, np.abs(expected).max(axis=1))).max()
    if not gap <= FOLD_RELATIVE:
        raise SoundnessError(
            f"{name}: the folded network differs from the file's by {gap:.1e} (relative)."
        )
    return net


def read_onnx(path, normalisation: Normalisation | None = None) -> ReLUNetwork:
    """The network of an ONNX file with one input and one output, in float64. normalisation: as of
    `load_network`. Raises InputError that names the unreadable part.

    The numbers are those stored in the file; an inference engine that computes in float32 rounds on
    the way.
    """
    onnx, path = package("onnx", "ONNX files"), Path(path)
    with reading(path, "an ONNX file", Exception):  # protobuf has errors of its kinds
        graph = onnx.load(path).graph

    def array(tensor) -> np.ndarray:
        return onnx.numpy_helper.to_array(tensor).astype(np.float64)

    constants = {tensor.name: array(tensor) for tensor in graph.initializer}
    inputs = [i.name for i in graph.input if i.name not in constants]
    if len(inputs) != 1 or len(graph.output) != 1:
        raise InputError(
            f"{path}: expected one input and one output; got {len(inputs)} and {len(graph.output)}."
        )
    chain, at = [], inputs[0]
    for node in graph.node:
        attributes = {a.name: onnx.helper.get_attribute_value(a) for a in node.attribute}
        if node.op_type == "Constant" and "value" in attributes:
            constants[node.output[0]] = array(attributes["value"])
            continue
        if at not in node.input:
            raise InputError(
                f"{path}: expected a chain; {node.op_type} {node.name!r} does not follow {at!r}."
            )
        chain += _steps(path, node, attributes, constants, at)
        at = node.output[0]
    if at != graph.output[0].name:
        raise InputError(
            f"{path}: expected the chain to end in the output {graph.output[0].name!r}; it ends in "
            f"{at!r}."
        )
    return normalised(fold_chain(chain, str(path)), normalisation)


def _steps(path, node, attributes: dict, constants: dict, at: str) -> list:
    """One node as steps of a chain; in ONNX the running value is a row vector, one per example."""
    kind, inputs = node.op_type, list(node.input)
    if kind == "Relu":
        return [Relu()]
    if kind in _PASSING:
        return []
    try:
        if kind == "Gemm" and inputs[0] == at and not attributes.get("transA", 0):
            return [_gemm(attributes, *(constants[name] for name in inputs[1:]))]
        if kind == "MatMul" and inputs[0] == at and constants[inputs[1]].ndim == 2:
            W = constants[inputs[1]].T
            return [Linear(W, np.zeros(len(W)))]
        if kind in ("Add", "Sub", "Mul", "Div") and len(inputs) == 2 and inputs[0] != inputs[1]:
            side = inputs.index(at)
            return [_elementwise(path, kind, side, constants[inputs[1 - side]])]
    except KeyError as missing:
        raise InputError(
            f"{path}: {kind} {node.name!r} takes {missing}, which is no constant of the file."
        ) from None
    raise InputError(
        f"{path}: expected a chain of {KNOWN}; got {kind} {node.name!r} as it stands here."
    )


def _gemm(attributes: dict, B: np.ndarray, C: np.ndarray | None = None) -> Linear:
    W = attributes.get("alpha", 1.0) * (B if attributes.get("transB", 0) else B.T)
    b = np.zeros(len(W)) if C is None else attributes.get("beta", 1.0) * C
    return Linear(W, np.broadcast_to(b.reshape(-1), (len(W),)))


def _elementwise(path, kind: str, side: int, value: np.ndarray) -> Scale:
    """x op value (side 0) or value op x (side 1)."""
    if value.ndim > 1 and value.size != value.shape[-1]:
        raise InputError(
            f"{path}: expected {kind} with one number per coordinate; got an array {value.shape}."
        )
    value = value.reshape(-1) if value.size > 1 else value.reshape(())
    one = np.ones_like(value)
    if kind == "Add":
        return Scale(one, value)
    if kind == "Sub":
        return Scale(one, -value) if side == 0 else Scale(-one, value)
    if kind == "Mul":
        return Scale(value, 0 * one)
    if side == 1 or not value.all():
        raise InputError(f"{path}: expected Div by constants that are not zero.")
    return Scale(1 / value, 0 * one)
