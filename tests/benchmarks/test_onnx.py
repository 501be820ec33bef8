"""ONNX in and out against onnxruntime, and a safety question that another program reads."""

import importlib
import re

import jax
import numpy as np
import pytest
import toy_query
from needs import need
from toy_bodies import points_model, points_problem
from toy_models import host_outputs, random_network

from benchmarks.peers import onnx_network as chains
from benchmarks.peers.onnx_network import read_onnx
from benchmarks.peers.question import safety_question, vnnlib, write_onnx, write_question
from parc_jax.common.errors import InputError, SoundnessError
from parc_jax.planner import Planner
from parc_jax.proof.regions import enumerate_regions
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import verdicts

need("onnx", "onnxruntime")
onnx = importlib.import_module("onnx")


def run_onnx(path, x):
    """The outputs of an ONNX file by onnxruntime."""
    runtime = importlib.import_module("onnxruntime")
    session = runtime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    (entry,) = session.get_inputs()
    kind = np.float64 if entry.type == "tensor(double)" else np.float32
    return session.run(None, {entry.name: x.astype(kind)})[0]


def test_out_and_in_again_loses_nothing(rng, tmp_path):
    net, x = random_network(rng, 5), rng.normal(size=(300, 2))
    path = write_onnx(tmp_path / "net.onnx", net)
    assert read_onnx(path).hash == net.hash
    assert np.abs(run_onnx(path, x) - host_outputs(net, x)).max() < 1e-12
    single = write_onnx(tmp_path / "single.onnx", net, np.float32)
    assert np.abs(run_onnx(single, x) - host_outputs(read_onnx(single), x)).max() < 1e-4


def test_a_wrong_fold_is_noticed(rng, monkeypatch, tmp_path):
    real = chains.relu_network
    path = write_onnx(tmp_path / "net.onnx", random_network(rng, 5))
    monkeypatch.setattr(chains, "relu_network", lambda W, b: real(W, [v + 1e-2 for v in b]))
    with pytest.raises(SoundnessError, match="differs"):
        read_onnx(path)


def saved_graph(path, nodes, constants, n_in, n_out):
    """An ONNX file of the given nodes from X to Y. n_in: a size, or several."""
    sizes = n_in if isinstance(n_in, tuple) else (n_in,)
    ends = [
        [onnx.helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, [None, *n])]
        for name, n in (("X", sizes), ("Y", (n_out,)))
    ]
    tensors = [
        onnx.numpy_helper.from_array(np.asarray(v, np.float32), name)
        for name, v in constants.items()
    ]
    graph = onnx.helper.make_graph(
        [onnx.helper.make_node(*n[:3], **n[3]) for n in nodes], "g", *ends, tensors
    )
    opset = [onnx.helper.make_opsetid("", 17)]
    onnx.save(onnx.helper.make_model(graph, opset_imports=opset, ir_version=8), path)
    return path


def test_what_onnx_cannot_compute_row_by_row_is_refused_in_a_sentence(rng, tmp_path):
    W, column = rng.normal(size=(2, 6)), rng.normal(size=(6, 1))
    chains_of = {
        "axis 0": [("MatMul", ["X", "W"], ["a"], {}), ("Flatten", ["a"], ["Y"], {"axis": 0})],
        "column": [("MatMul", ["X", "W"], ["a"], {}), ("Add", ["a", "column"], ["Y"], {})],
        "missing": [("MatMul", ["X", "W"], ["a"], {}), ("Dropout", ["a", "", "no"], ["Y"], {})],
        "rows": [("Gemm", ["X", "W", "column"], ["Y"], {})],
    }
    for name, nodes in chains_of.items():
        path = saved_graph(tmp_path / f"{name}.onnx", nodes, {"W": W, "column": column}, 2, 6)
        with pytest.raises(InputError, match="expected a chain that onnx computes for many rows"):
            read_onnx(path)


def test_an_input_of_two_known_sizes_is_refused_and_no_layer_is_blamed(rng, tmp_path):
    nodes = [("Flatten", ["X"], ["a"], {}), ("MatMul", ["a", "W"], ["Y"], {})]
    constants = {"W": rng.normal(size=(4, 3))}
    assert read_onnx(saved_graph(tmp_path / "row.onnx", nodes, constants, (1, 4), 3)).n_in == 4
    with pytest.raises(InputError, match="one input, rows of a known size"):
        read_onnx(saved_graph(tmp_path / "table.onnx", nodes, constants, (2, 2), 3))


@pytest.mark.parametrize("domain", ["mine", ""])
def test_a_function_of_a_known_name_is_not_taken_for_the_operation(rng, tmp_path, domain):
    """A Relu of its own that is another thing beyond the inputs that are tried."""
    nodes = [("MatMul", ["X", "W"], ["a"], {}), ("Relu", ["a"], ["Y"], {"domain": domain})]
    path = saved_graph(tmp_path / "net.onnx", nodes, {"W": rng.normal(size=(2, 3))}, 2, 3)
    model, (make, opset) = onnx.load(path), (onnx.helper.make_node, onnx.helper.make_opsetid)
    bounds = [make("Constant", [], [n], value_float=v) for n, v in (("lo", 0.0), ("hi", 1e9))]
    body = [*bounds, make("Clip", ["x", "lo", "hi"], ["y"])]
    function = onnx.helper.make_function(domain, "Relu", ["x"], ["y"], body, [opset("", 17)])
    model.functions.append(function)
    model.opset_import.extend([opset("mine", 1)])
    onnx.save(model, path)
    with pytest.raises(InputError, match=f"Relu of '{domain}'"):
        read_onnx(path)


def test_what_exporters_write_is_read(rng, tmp_path):
    constants = {
        "mean": [0.5, -1.0],
        "scale": [2.0, 4.0],
        "W": rng.normal(size=(2, 6)),
        "b": rng.normal(size=6),
        "V": rng.normal(size=(3, 6)),
        "v": rng.normal(size=3),
        "gain": 3.0,
        "one": [[1.0, 2.0, 3.0]],
    }
    nodes = [
        ("Sub", ["X", "mean"], ["a"], {}),
        ("Div", ["a", "scale"], ["c"], {}),
        ("MatMul", ["c", "W"], ["d"], {}),
        ("Add", ["b", "d"], ["e"], {}),
        ("Relu", ["e"], ["f"], {}),
        ("Identity", ["f"], ["i"], {}),
        ("Gemm", ["i", "V", "v"], ["g"], {"transB": 1, "alpha": 0.5, "beta": 2.0}),
        ("Mul", ["gain", "g"], ["h"], {}),
        ("Sub", ["one", "h"], ["Y"], {}),
    ]
    path = saved_graph(tmp_path / "net.onnx", nodes, constants, 2, 3)
    x = rng.normal(size=(200, 2))
    assert np.abs(run_onnx(path, x) - host_outputs(read_onnx(path), x)).max() < 1e-4


@pytest.mark.parametrize(
    ("nodes", "message"),
    [
        ([("Tanh", ["X"], ["Y"], {})], "Tanh"),
        ([("Relu", ["X"], ["a"], {}), ("Add", ["a", "a"], ["Y"], {})], "Add"),
        ([("Relu", ["X"], ["a"], {}), ("Relu", ["X"], ["Y"], {})], "does not follow"),
        ([("Add", ["X", "unknown"], ["Y"], {})], "no constant"),
    ],
)
def test_other_graphs_are_refused(tmp_path, nodes, message):
    with pytest.raises(InputError, match=message):
        read_onnx(saved_graph(tmp_path / "net.onnx", nodes, {}, 2, 2))


@pytest.fixture
def asked():
    return toy_query.answer()


def margins_at_vertices(question):
    """The exact minimum of a piecewise affine map over a box is at a vertex of a region."""
    return host_outputs(
        question.net, np.asarray(enumerate_regions(question.net, question.plans).points)
    ).min()


def test_the_question_is_about_the_samples_safety(asked, rng, tmp_path):
    small, large = (safety_question(asked, 0, h) for h in (1e-6, 0.6))
    assert margins_at_vertices(small) > 0 > margins_at_vertices(large)
    x = rng.uniform(large.plans.lo, large.plans.hi, (4000, 4))
    positive = (host_outputs(large.net, x) > 0).all(axis=1)
    assert 0 < positive.sum() < 4000
    x = x[positive]
    step = np.stack([x[:, 2], np.abs(x[:, 3])], axis=1)
    path = x[:, None, :2] + np.linspace(0, 1, 5)[None, :, None] * step[:, None]
    assert (np.abs(path[:, -1]) <= 0.25 - 0.02).all()
    late = path[:, 1:].reshape(-1, 2)  # the block exists in intervals 1 to 3
    assert not ((late > [-0.52, 0.28]) & (late < [0.02, 0.62])).all(axis=1).any()
    model, text = write_question(tmp_path, small)
    assert np.abs(run_onnx(model, x) - host_outputs(small.net, x)).max() < 1e-12
    assert text.read_text() == vnnlib(small)


def test_the_property_file_spells_box_and_margins_exactly(asked):
    question = safety_question(asked, 1, 0.01)
    text = vnnlib(question)
    lo = [float(v) for v in re.findall(r"\(assert \(>= X_\d+ (\S+?)\)\)", text)]
    hi = [float(v) for v in re.findall(r"\(assert \(<= X_\d+ (\S+?)\)\)", text)]
    assert (lo == question.plans.lo).all() and (hi == question.plans.hi).all()
    assert text.count("(and (<= Y_") == question.net.n_out and text.count("(") == text.count(")")


def test_the_property_file_says_of_which_network_it_is_and_what_the_tube_is(asked, tmp_path):
    question = safety_question(asked, 0, 0.01)
    for dtype, proof in ((np.float64, True), (np.float32, False)):
        text = write_question(tmp_path, question, dtype)[1].read_text()
        said = [line[2:] for line in text.splitlines() if line.startswith("; ")]
        assert ("every plan (p0, k) in the box is safe" in said[0]) == proof
        assert ("no proof" in said[0] and "rounded to float32" in said[0]) != proof
        assert said[-1] == f"The tube: {asked.model.claim.details()}"
        assert "not shown" in said[-1]  # declared
        assert any("of it nothing is said at other times" in line for line in said)  # obstacles


@pytest.mark.night
@pytest.mark.parametrize("fitted", [False, True], ids=["boxes", "faces"])
def test_the_question_of_a_body_is_about_every_part_and_point(fitted):
    """What the margins call safe is safe by the verdict, which knows nothing of them."""
    rng = np.random.default_rng(3)
    model = points_model(rng, fitted=fitted)
    problem = points_problem(rng, model)
    options = {"samples": 2, "target": 0.3, "budget_s": 300.0}
    answer = Planner(model).solve(problem, jax.random.key(0), Settings(**options))
    question = safety_question(answer, 0, 0.15)
    of_parts = sum(len(part.points) for part in problem.parts) * len(problem.obstacles)
    assert question.net.n_out == len(problem.goal.b) + 2 * model.time.n_steps * of_parts
    x = rng.uniform(question.plans.lo, question.plans.hi, (4000, 4))
    margins = host_outputs(question.net, x)
    positive = (margins > 0).all(axis=1)
    assert 0 < positive.sum() < 4000
    safe = verdicts(answer.scene, x[:, :2], x[:, 2:]).safe
    assert safe[positive].all()


def test_questions_that_make_no_sense(asked):
    with pytest.raises(InputError, match="sample between"):
        safety_question(asked, 99, 0.1)
    with pytest.raises(InputError, match="positive half widths"):
        safety_question(asked, 0, 0.0)
