"""One safety question for other verifiers: a ReLU network of margins over a box of plans, as ONNX
and VNN-LIB.

For a sample of an answer, with its separating directions fixed, "every plan in this box is safe" is
"every margin is positive over the box". Margins are affine in the trajectory, so they are one more
linear layer. The start p0 is carried past the hidden layers by p0 = relu(p0 - lo) + lo, which is
exact on the box.
"""

from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.checker import number
from parc_jax.common.errors import InputError
from parc_jax.common.on_use import package
from parc_jax.common.sets.box import Box, box
from parc_jax.learning.bound.error_set import at
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.relu import ReLUNetwork, relu_network
from parc_jax.learning.runs.files import write_atomic
from parc_jax.proof.certificate.write import by_pair
from parc_jax.safe_set.separation.directions import Multiplier
from parc_jax.safe_set.verdict.scene import unpruned_scene
from parc_jax.statement import resting_on

OPSET, IR_VERSION = 17, 8  # old enough for every verifier and engine in use
PROOF = "unsat: every plan (p0, k) in the box is safe for every run inside the tube"
NO_PROOF = (
    "unsat is no proof that a plan is safe: the network that it is of was rounded to float32, and "
    "so is another one"
)


class NetworkQuestion(NamedTuple):
    """Is every output of the network positive over the box? Then every plan in it is safe, for
    every run in the tube.

    net: (p0, k) (n_p + n_k,) -> margins (m,) [row units]: goal rows first, then two per interval
        and reference point of each pair of an obstacle and a part of the body.
    plans: Box over (p0, k).
    rests_on: sentences about what the question rests on, the tube last.
    """

    net: ReLUNetwork
    plans: Box
    rests_on: tuple[str, ...]


def safety_question(answer: Answer, sample: int, half_width) -> NetworkQuestion:
    """The question about the box around one sample of an answer, with the directions of its
    certificate.

    half_width: () or (n_p + n_k,) in units of p0 and k. Widths of the tube are the largest of the
    bins that the box meets. A "no" does not mean unsafe: other directions may still prove it.
    Raises InputError.
    """
    model = answer.model
    if not 0 <= sample < len(answer.samples):
        raise InputError(
            f"question: expected a sample between 0 and {len(answer.samples) - 1}; got {sample}."
        )
    half = np.broadcast_to(np.asarray(half_width, np.float64), answer.samples[sample].shape)
    if not (half > 0).all():
        raise InputError("question: expected positive half widths.")
    lo, hi = answer.samples[sample] - half, answer.samples[sample] + half
    k = slice(model.n_p, None)
    lo[k], hi[k] = np.maximum(lo[k], model.domain.lo), np.minimum(hi[k], model.domain.hi)
    margins = _margins(answer, sample, _bins(model.tube, lo[k], hi[k]))
    net = _margin_network(model.net, model.n_p, lo[: model.n_p], *margins)
    rests_on = (*resting_on(answer.scene.nominal), f"The tube: {model.claim.details()}")
    return NetworkQuestion(net, box(lo, hi), rests_on)


def write_question(folder, question: NetworkQuestion, dtype=np.float64) -> tuple[Path, Path]:
    """question.onnx and question.vnnlib in a folder. dtype as in `write_onnx`; unsat: every plan of
    the box is safe, in float64 alone.
    """
    folder = Path(folder)
    model = write_onnx(folder / "question.onnx", question.net, dtype)
    return model, write_atomic(folder / "question.vnnlib", vnnlib(question, dtype).encode())


def vnnlib(question: NetworkQuestion, dtype=np.float64) -> str:
    """The negated question in VNN-LIB: a plan in the box with some margin <= 0. dtype: of the
    network that it is asked of.
    """
    n_in, n_out = question.net.n_in, question.net.n_out
    said = "\n".join([PROOF if np.dtype(dtype) == np.float64 else NO_PROOF, *question.rests_on])
    lines = [f"; {line}" for line in said.splitlines()]
    lines += [f"(declare-const X_{i} Real)" for i in range(n_in)]
    lines += [f"(declare-const Y_{i} Real)" for i in range(n_out)]
    for i, (lo, hi) in enumerate(zip(question.plans.lo, question.plans.hi, strict=True)):
        lines += [f"(assert (>= X_{i} {_real(lo)}))", f"(assert (<= X_{i} {_real(hi)}))"]
    unsafe = "\n  ".join(f"(and (<= Y_{i} 0.0))" for i in range(n_out))
    return "\n".join([*lines, f"(assert (or\n  {unsafe}\n))", ""])


def _bins(tube: Tube, lo: np.ndarray, hi: np.ndarray) -> np.ndarray:
    """Numbers of the closed bins that meet the box of k. Raises InputError when one of them has no
    claim.
    """
    boxes = [tube.bin_box(i) for i in range(tube.n_bins)]
    met = np.array([i for i, (a, b) in enumerate(boxes) if (a <= hi).all() and (b >= lo).all()])
    if not tube.claimed[met].all():
        raise InputError("question: the box meets a bin of K that has no claim; make it smaller.")
    return met


def _margins(answer: Answer, sample: int, bins: np.ndarray):
    """Rows (m, n_p + n_out) over (p0, outputs) and offsets (m,): margin = row . (p0, outputs) +
    offset, with the most that the errors of these bins may take.
    """
    problem, model = answer.problem, answer.model
    scene = unpruned_scene(answer.scene)
    n_p, n_c, T, tube = model.n_p, model.n_c, model.time.n_steps, model.tube
    n_in = n_p + model.net.n_out
    rows, offsets = [], []

    def place(knot: int, point: int) -> np.ndarray:
        """(n_p, n_in) selects the place of a reference point at a knot: p0 + its offset."""
        out = np.eye(n_p, n_in)
        first = knot * n_c + point * n_p
        if first:  # the first point starts at p0 itself
            out[:, first : first + n_p] = np.eye(n_p)
        return out

    state = np.eye(model.n_q, n_in, (T + 1) * n_c)
    end = np.concatenate([place(T, i) for i in range(model.n_points)] + [state])
    lost = at(tube.final_errors, (bins, None)).support(problem.goal.A).max(axis=0)
    rows += list(-problem.goal.A @ end)
    offsets += list(problem.goal.b - lost)
    if problem.start is not None:
        rows += list(-problem.start.A @ place(0, 0))
        offsets += list(problem.start.b)
    table = scene.directions
    assert table is not None  # the scene of an answer has them
    sep = by_pair(answer.certificates[sample]["sep"])
    for o, runs in enumerate(sep):
        first = int(np.argmax(scene.obstacles.active[o]))
        for stop, terms in runs:
            multiplier = Multiplier(
                tuple(row for row, _ in terms), tuple(number(v) for _, v in terms)
            )
            w, support = table.direction(o, multiplier)
            for t in range(first, stop):
                most = tube.during(bins, t).support(-w).max(axis=0)
                for i in np.unique(scene.obstacles.points[o]):
                    rows += [w @ place(t, i), w @ place(t + 1, i)]
                    offsets += 2 * [-(support + most[i])]
            first = stop
    slack = float(scene.slack)  # margins are rounded; each pays for it
    sizes = np.abs(np.array(rows)).sum(axis=1)
    return np.array(rows), np.array(offsets) - slack * sizes


def _margin_network(net: ReLUNetwork, n_p: int, p0_lo: np.ndarray, rows, offsets) -> ReLUNetwork:
    """Rows (m, n_p + n_out) over (p0, net(k)) as a network of (p0, k)."""
    weights, biases = [], []
    for i, (W, b) in enumerate(zip(net.weights[:-1], net.biases[:-1], strict=True)):
        carry = np.zeros((n_p + W.shape[0], n_p + W.shape[1]))
        carry[:n_p, :n_p], carry[n_p:, n_p:] = np.eye(n_p), W
        weights.append(carry)
        biases.append(np.concatenate([-p0_lo if i == 0 else np.zeros(n_p), b]))
    shift = p0_lo if weights else np.zeros(n_p)
    last = np.concatenate([rows[:, :n_p], rows[:, n_p:] @ net.weights[-1]], axis=1)
    bias = rows[:, n_p:] @ net.biases[-1] + rows[:, :n_p] @ shift + offsets
    return relu_network([*weights, last], [*biases, bias])


def _real(value: float) -> str:
    """A decimal without exponent that spells the float exactly."""
    text = format(Decimal(float(value)), "f")
    return text if "." in text else f"{text}.0"


def write_onnx(path, net: ReLUNetwork, dtype=np.float64) -> Path:
    """Write the network as Gemm and Relu nodes, input `X` (batch, n_in), output `Y` (batch, n_out);
    atomically.

    dtype: float64 is exact; float32, which most verifiers read, is another, rounded network.
    Raises InputError.
    """
    onnx, dtype = package("onnx", "ONNX files"), np.dtype(dtype)
    if dtype not in (np.float32, np.float64):
        raise InputError(f"onnx: expected dtype float32 or float64; got {dtype}.")
    nodes, constants, at = [], [], "X"
    for i, (W, b) in enumerate(zip(net.weights, net.biases, strict=True)):
        last = i == len(net.weights) - 1
        for name, value in ((f"W{i}", W), (f"b{i}", b)):
            constants.append(onnx.numpy_helper.from_array(value.astype(dtype), name))
        inputs, name = [at, f"W{i}", f"b{i}"], "Y" if last else f"z{i}"
        nodes.append(onnx.helper.make_node("Gemm", inputs, [name], f"linear{i}", transB=1))
        if not last:
            at = f"h{i}"
            nodes.append(onnx.helper.make_node("Relu", [name], [at], f"relu{i}"))
    kind = onnx.helper.np_dtype_to_tensor_dtype(dtype)
    sizes = (("X", net.n_in), ("Y", net.n_out))
    ends = [[onnx.helper.make_tensor_value_info(name, kind, ["batch", n])] for name, n in sizes]
    graph = onnx.helper.make_graph(nodes, "parc_jax", *ends, initializer=constants)
    opset = [onnx.helper.make_opsetid("", OPSET)]
    version = {"opset_imports": opset, "ir_version": IR_VERSION, "producer_name": "parc_jax"}
    model = onnx.helper.make_model(graph, **version)
    onnx.checker.check_model(model)
    return write_atomic(path, model.SerializeToString())
