"""ONNX files out: our networks for other tools."""

from pathlib import Path

import numpy as np

from parc_jax.app.files.onnx_read import onnx_package
from parc_jax.common.errors import InputError
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.files import write_atomic

OPSET, IR_VERSION = 17, 8  # old enough for every verifier and engine in use


def write_onnx(path, net: ReLUNetwork, dtype=np.float64) -> Path:
    """Write the network as Gemm and Relu nodes, input `X` (batch, n_in), output `Y` (batch, n_out);
    atomically.

    dtype: float64 keeps every bit; float32 is what most verifiers read, and is another, rounded
        network.
    Raises InputError.
    """
    onnx, dtype = onnx_package(), np.dtype(dtype)
    if dtype not in (np.float32, np.float64):
        raise InputError(f"onnx: expected dtype float32 or float64; got {dtype}.")
    nodes, constants, at = [], [], "X"
    for i, (W, b) in enumerate(zip(net.weights, net.biases, strict=True)):
        last = i == len(net.weights) - 1
        constants += [
            onnx.numpy_helper.from_array(v.astype(dtype), f"{n}{i}")
            for n, v in (("W", W), ("b", b))
        ]
        name = "Y" if last else f"z{i}"
        nodes.append(
            onnx.helper.make_node("Gemm", [at, f"W{i}", f"b{i}"], [name], f"linear{i}", transB=1)
        )
        if not last:
            at = f"h{i}"
            nodes.append(onnx.helper.make_node("Relu", [name], [at], f"relu{i}"))
    kind = onnx.helper.np_dtype_to_tensor_dtype(dtype)
    sizes = (("X", net.n_in), ("Y", net.n_out))
    ends = [[onnx.helper.make_tensor_value_info(name, kind, ["batch", n])] for name, n in sizes]
    graph = onnx.helper.make_graph(nodes, "parc_jax", *ends, initializer=constants)
    opset = [onnx.helper.make_opsetid("", OPSET)]
    model = onnx.helper.make_model(
        graph, opset_imports=opset, ir_version=IR_VERSION, producer_name="parc_jax"
    )
    onnx.checker.check_model(model)
    return write_atomic(path, model.SerializeToString())
