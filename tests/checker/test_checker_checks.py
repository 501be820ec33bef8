"""Every check of the checker is needed: each has a certificate that it alone rejects.

Each check is neutralised in turn, by rewriting the checker's source; some certificate of known.CASES must then be
accepted wrongly. If none is, the check is redundant or untested.
"""

import ast
import contextlib
import json
import sys
import traceback
import types
from pathlib import Path

import answer_files as build
import known
import pytest

from parc_jax import checker, checker_cells

MODULES = {"checker": checker, "checker_cells": checker_cells}
SOURCES = {name: Path(module.__file__).read_text() for name, module in MODULES.items()}


@contextlib.contextmanager
def limited(limits, *modules):
    """Smaller limits of the checker for a while."""
    old = [(m, name, getattr(m, name)) for m in modules for name in limits if hasattr(m, name)]
    for m, name, _ in old:
        setattr(m, name, limits[name])
    yield
    for m, name, value in old:
        setattr(m, name, value)


def rejection(case, folder, module=checker, cells=checker_cells):
    """The Rejected that a checker raises for a file, or None if it accepts; anything else is raised."""
    text, limits = case
    path = folder / "answer.json"
    path.write_text(text)
    with limited(limits, module, cells):
        try:
            module.check_answer(module.load(path))
        except module.Rejected as why:
            return why
    return None


@pytest.mark.parametrize("name", known.VALID)
def test_the_scenes_behind_the_cases_are_valid(name, tmp_path):
    assert rejection((json.dumps(build.rehash(known.VALID[name]())), {}), tmp_path) is None


def test_touching_needs_room_of_one_rounding(tmp_path):
    """The twin of the rounding case, a whole unit of rounding further away, is accepted."""
    assert rejection((json.dumps(known.change(known.plain(), known.rounding(3))), {}), tmp_path) is None


@pytest.mark.parametrize("name", known.CASES)
def test_bad_certificates_are_rejected(name, tmp_path):
    make, limits = known.CASES[name]
    assert rejection((make(), limits), tmp_path) is not None


class Neutralise(ast.NodeTransformer):
    """Removes the n-th check: need(x, ..) becomes need(True, ..); whole, array, fields, vector let everything pass."""

    def __init__(self, target):
        self.target, self.seen, self.done = target, -1, None

    def visit_Call(self, node):
        self.generic_visit(node)
        name = getattr(node.func, "attr", getattr(node.func, "id", None))
        if name not in ("need", "whole", "array", "vector", "fields"):
            return node
        self.seen += 1
        if self.seen != self.target:
            return node
        self.done = (ast.unparse(node), range(node.lineno, node.end_lineno + 1))
        if name == "need":
            node.args[0] = ast.Constant(True)
        elif name == "vector":
            node.args[1] = ast.Constant(None)
        else:
            return node.args[0]
        return node


def neutralised():
    """(module, what is removed, its lines, mutated source) for every check."""
    for name, source in SOURCES.items():
        for n in range(len(source)):
            mutation = Neutralise(n)
            tree = ast.fix_missing_locations(mutation.visit(ast.parse(source)))
            if mutation.done is None:
                break
            yield name, *mutation.done, ast.unparse(tree)


def load_mutant(monkeypatch, name, source):
    """(checker, checker_cells) with one of them replaced by a mutant."""
    module = types.ModuleType(f"parc_jax.{name}_mutant")
    module.__package__ = "parc_jax"
    monkeypatch.setitem(sys.modules, module.__name__, module)
    exec(compile(source, module.__name__, "exec"), module.__dict__)
    if name == "checker":
        return module, checker_cells
    monkeypatch.setitem(sys.modules, "parc_jax.checker_cells", module)
    return checker, module


def passed_lines(error):
    """(file name without .py, line) of every frame on the way to a rejection."""
    while error is not None:
        yield from ((Path(f.filename).stem, f.lineno) for f in traceback.extract_tb(error.__traceback__))
        error = error.__cause__


@pytest.mark.soundness
def test_every_check_has_a_certificate_that_only_it_rejects(monkeypatch, tmp_path):
    """A mutant is shown the certificates that are rejected while its check runs; it must accept one."""
    cases = {name: (make(), limits) for name, (make, limits) in known.CASES.items()}
    lines = {name: set(passed_lines(rejection(case, tmp_path))) for name, case in cases.items()}
    survivors, count = [], 0
    for name, what, where, source in neutralised():
        count += 1
        with monkeypatch.context() as patch:
            pair = load_mutant(patch, name, source)
            related = [case for case in cases if any((name, line) in lines[case] for line in where)]
            if not any(rejection(cases[case], tmp_path, *pair) is None for case in related):
                survivors.append(f"{name}: {what}")
    assert count > 70
    assert not survivors, "no certificate is rejected by these alone:\n" + "\n".join(survivors)


# Slips of a programmer: module, right, wrong, and the certificate that tells them apart.
SLIPS = [
    ("checker", "value > 0 if strict else value >= 0", "value >= 0", "touching"),
    ("checker", "b - Fraction(dot(map(abs, a), final), self.e_scale)", "b", "a goal missed by less than the tube"),
    ("checker", "h + self.body_support(w)", "h", "touching"),
    ("checker", "-H - width", "-H", "touching"),
    ("checker", "max(grow[max(s - 1 - t, 0)], grow[min(s, stop - 1) - t])", "grow[max(s - 1 - t, 0)]",
     "contact at knot 1, in the second interval's width only"),
    ("checker", "max(grow[max(s - 1 - t, 0)], grow[min(s, stop - 1) - t])", "grow[min(s, stop - 1) - t]",
     "contact at knot 1, in the first interval's width only"),
    ("checker", "for s in range(t, stop + 1)", "for s in range(t + 1, stop + 1)", "contact at the first knot only"),
    ("checker", "for s in range(t, stop + 1)", "for s in range(t, stop)", "contact at the last knot only"),
    ("checker", "operator.le, max", "operator.le, min", "contact in the width of one of two bins"),
    ("checker", "operator.le, max", "operator.le, min", "a goal missed in one of two bins"),
    ("checker", "(root * root < square)", "0", "touching by less than the rounding of a root"),
    ("checker", "max(-dot(w, v)", "max(dot(w, v)", "touching with a polygon"),
    ("checker", "max(-dot(w, v)", "min(-dot(w, v)", "touching with a polygon"),
    ("checker", "value >= 0 if constant else value > 0", "value >= 0", "an inner point on a neuron's boundary"),
    ("checker", "value >= 0 if constant else value > 0", "value >= 0", "an inner point on the goal's boundary"),
    ("checker", "value >= 0 if constant", "True if constant", "a constant neuron with the wrong sign"),
    ("checker", "(1, self.lo[i]), ", "", "an inner point at the domain's lower end"),
    ("checker", "(1, low), ", "", "an inner point below its bin"),
    ("checker", "(-1, self.hi[i]), ", "", "an inner point at the domain's upper end"),
    ("checker", ", (-1, high)", "", "an inner point above its bin"),
    ("checker", 'row if bit == "1" else [-x for x in row]', "row", "a pattern for the other side"),
    ("checker", ', "corridors": context.check_sample', "", "a corridor whose plan does not keep to it"),
    ("checker", '{"corridors": [], **answer}', '{**answer, "corridors": []}', "a corridor with a negative multiplier"),
    ("checker", "enumerate(array(answer[kind]))", "enumerate(array(answer[kind])[:1])",
     "a second corridor whose plan does not keep to it"),
    ("checker", "operator.le, max", "operator.le, min", "a corridor whose plan does not keep to it in one of two bins"),
    ("checker", '"01"[x > 0]', '"1"', "a goal reached by the network without ReLU only"),
    ("checker", 'network["biases"], strict=True', 'network["biases"], strict=False', "biases of another layer"),
    ("checker", "self.lo, self.hi, strict=True", "self.lo, self.hi, strict=False", "edges of a second axis"),
    ("checker", "object_pairs_hook=unique, ", "", "a key twice"),
    ("checker", "parse_float=refuse, ", "", "a float in a part that is ignored"),
    ("checker", ", parse_constant=refuse", "", "a NaN in a part that is ignored"),
    ("checker_cells", 'max if name == "safe" else min', "max", "a goal leaf for the wider of two bins"),
    ("checker_cells", 'max if name == "safe" else min', "max", "an error in the wider of two bins"),
    ("checker_cells", 'max if name == "safe" else min', "min", "a safe leaf inside the narrower of two bins"),
    ("checker_cells", "operator.le, min", "operator.le, max", "a box of z for the wider of two bins"),
    ("checker_cells", "hi[i]), pair, strict=True", "hi[i]), pair, strict=False", "one face missing"),
    ("checker_cells", "if min(signs) < 0 < max(signs)", "if False", "a safe leaf that fails between the corners of k"),
    ("checker_cells", "== 2", "== 3", "a safe leaf that fails between the corners of k"),
    ("checker_cells", "for side in (1, -1)", "for side in (1,)", "a safe leaf that fails between the corners of k"),
    ("checker_cells", "any(all(", "any(any(", "a hit at some vertices only"),
]  # fmt: skip


@pytest.mark.soundness
@pytest.mark.parametrize("slip", SLIPS, ids=lambda slip: f"{slip[1]} -> {slip[2]}, {slip[3]}")
def test_slips_in_the_checker_are_noticed(slip, monkeypatch, tmp_path):
    name, right, wrong, case = slip
    assert SOURCES[name].count(right) == 1
    make, limits = known.CASES[case]
    assert rejection((make(), limits), tmp_path) is not None
    pair = load_mutant(monkeypatch, name, SOURCES[name].replace(right, wrong))
    assert rejection((make(), limits), tmp_path, *pair) is None
