"""ONNX files in: a chain of linear operations and ReLU, read operation by operation."""

from pathlib import Path

import numpy as np

from parc_jax.app.files.chain import Linear, Relu, Scale, fold_chain
from parc_jax.common.errors import InputError
from parc_jax.common.on_use import package
from parc_jax.learning.network.relu import ReLUNetwork

KNOWN = "Gemm, MatMul, Add, Sub, Mul, Div, Relu, Flatten, Identity, Dropout, Constant"
_PASSING = ("Identity", "Flatten", "Dropout")


def onnx_package():
    """The package onnx. Raises InputError when it is not installed."""
    return package("onnx", "ONNX files", "exchange")


def read_onnx(path) -> ReLUNetwork:
    """The network of an ONNX file with one input and one output, in float64. Raises InputError.

    The numbers are those stored in the file; an inference engine that computes in float32 rounds on
    the way.
    """
    onnx, path = onnx_package(), Path(path)
    try:
        graph = onnx.load(path).graph
    except FileNotFoundError:
        raise InputError(f"{path}: no such file.") from None
    except Exception as error:  # protobuf raises its own kinds
        raise InputError(
            f"{path}: expected an ONNX file; {type(error).__name__}: {error!s:.120}."
        ) from None
    constants = {
        t.name: onnx.numpy_helper.to_array(t).astype(np.float64) for t in graph.initializer
    }
    inputs = [i.name for i in graph.input if i.name not in constants]
    if len(inputs) != 1 or len(graph.output) != 1:
        raise InputError(
            f"{path}: expected one input and one output; got {len(inputs)} and {len(graph.output)}."
        )
    chain, at = [], inputs[0]
    for node in graph.node:
        attributes = {a.name: onnx.helper.get_attribute_value(a) for a in node.attribute}
        if node.op_type == "Constant" and "value" in attributes:
            constants[node.output[0]] = onnx.numpy_helper.to_array(attributes["value"]).astype(
                np.float64
            )
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
    return fold_chain(chain, str(path))


def _steps(path, node, attributes: dict, constants: dict, at: str) -> list:
    """One node as steps of a chain; the running value has rows as examples, so x is a row vector in
    ONNX.
    """
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
            return [
                _elementwise(path, kind, inputs.index(at), constants[inputs[1 - inputs.index(at)]])
            ]
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
