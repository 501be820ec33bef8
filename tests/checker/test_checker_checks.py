"""Every check of the checker is needed: each has a certificate that it alone rejects.

Each check is neutralised in turn, by rewriting the checker's source; some certificate of
CASES must then be accepted wrongly. If none is, the check is redundant or untested.
"""

import ast
import contextlib
import importlib
import itertools
import json
import sys
import traceback
from pathlib import Path

import answer_files as build
import known
import known_points
import pytest

from parc_jax import checker

CASES = known.CASES | known_points.CASES
VALID = known.VALID | known_points.VALID
FOLDER = Path(checker.__file__).parent
FILES = (
    "exact",
    "errors",
    "question",
    "plans",
    "cells",
    "bounds",
    "hits",
    "no_plan",
    "doubt",
    "claim",
    "entries",
    "answer",
)
OF_EPISODES = ("episode", "rests_on", "turns")  # which have tests of their own: test_episode.py
SOURCES = {name: (FOLDER / f"{name}.py").read_text() for name in FILES}
NUMBERS = itertools.count()


@contextlib.contextmanager
def limited(limits, package):
    """Smaller limits of a checker for a while."""
    modules = [getattr(package, name) for name in FILES]
    old = [(m, name, getattr(m, name)) for m in modules for name in limits if hasattr(m, name)]
    for m, name, _ in old:
        setattr(m, name, limits[name])
    yield
    for m, name, value in old:
        setattr(m, name, value)


def rejection(case, folder, package=checker):
    """The Rejected that a checker raises for a file, or None if it accepts; anything else is
    raised.
    """
    text, limits = case
    path = folder / "answer.json"
    path.write_text(text)
    with limited(limits, package):
        try:
            package.check_answer(package.load(path))
        except package.Rejected as why:
            return why
    return None


@pytest.mark.parametrize("name", VALID)
def test_the_scenes_behind_the_cases_are_valid(name, tmp_path):
    assert rejection((json.dumps(build.rehash(VALID[name]())), {}), tmp_path) is None


def test_touching_needs_room_of_one_rounding(tmp_path):
    """The twin of the rounding case, a whole unit of rounding further away, is accepted."""
    assert (
        rejection((json.dumps(known.change(known.plain(), known.rounding(3))), {}), tmp_path)
        is None
    )


@pytest.mark.parametrize("name", CASES)
def test_bad_certificates_are_rejected(name, tmp_path):
    make, limits = CASES[name]
    assert rejection((make(), limits), tmp_path) is not None


class Neutralise(ast.NodeTransformer):
    """Removes the n-th check: need(x, ..) becomes need(True, ..); whole, array, fields, vector let
    everything pass.
    """

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
        for n in itertools.count():
            mutation = Neutralise(n)
            tree = ast.fix_missing_locations(mutation.visit(ast.parse(source)))
            if mutation.done is None:
                break
            yield name, *mutation.done, ast.unparse(tree)


def load_mutant(monkeypatch, folder, name, source, strict=True):
    """The checker as a package of its own, with one of its files replaced by a mutant; if it is not
    strict, lists of different lengths are paired silently in all of them.
    """
    package = f"checker_mutant_{next(NUMBERS)}"
    (folder / package).mkdir()
    for other in ("__init__", *FILES, *OF_EPISODES):
        text = source if other == name else (FOLDER / f"{other}.py").read_text()
        text = text if strict else text.replace("strict=True", "strict=False")
        (folder / package / f"{other}.py").write_text(text)
    monkeypatch.syspath_prepend(folder)
    mutant = importlib.import_module(package)
    for loaded in (package, *(f"{package}.{other}" for other in (*FILES, *OF_EPISODES))):
        monkeypatch.delitem(sys.modules, loaded)
    return mutant


def passed_lines(error):
    """(file name without .py, line) of every frame on the way to a rejection."""
    while error is not None:
        yield from (
            (Path(f.filename).stem, f.lineno) for f in traceback.extract_tb(error.__traceback__)
        )
        error = error.__cause__


@pytest.mark.slow
@pytest.mark.soundness
def test_every_check_has_a_certificate_that_only_it_rejects(monkeypatch, tmp_path):
    """A mutant is shown the certificates that are rejected while its check runs; it must accept
    one. Lengths are checked when read and again where lists are paired: both guards go together.
    """
    cases = {name: (make(), limits) for name, (make, limits) in CASES.items()}
    lines = {name: set(passed_lines(rejection(case, tmp_path))) for name, case in cases.items()}
    survivors, count = [], 0
    for name, what, where, source in neutralised():
        count += 1
        related = [case for case in cases if any((name, line) in lines[case] for line in where)]
        for strict in (True, False):
            with monkeypatch.context() as patch:
                mutant = load_mutant(patch, tmp_path, name, source, strict)
                found = any(rejection(cases[case], tmp_path, mutant) is None for case in related)
            if found:
                break
        else:
            survivors.append(f"{name}: {what}")
    assert count > 80
    assert not survivors, "no certificate is rejected by these alone:\n" + "\n".join(survivors)


# Slips of a programmer: file, right, wrong, and the certificate that tells them apart; others are
# planted at night: benchmarks/attacks/faults_checker.py.
SLIPS = [
    ("plans", "root += 1", "root += 0", "touching by less than the rounding of a root"),
    (
        "plans",
        "inside = value > 0",
        "inside = value >= 0",
        "an inner point on a neuron's boundary",
    ),
    (
        "plans",
        "inside = value > 0",
        "inside = value >= 0",
        "an inner point on the goal's boundary",
    ),
    (
        "plans",
        "else value >= 0",
        "else True",
        "a constant neuron with the wrong sign",
    ),
    ("plans", "(1, self.lo[i], False),", "", "an inner point at the domain's lower end"),
    ("plans", "(-1, self.hi[i], False),", "", "an inner point at the domain's upper end"),
    ("plans", "(-1, high, place < n_places - 1),", "", "an inner point above its bin"),
    ("plans", 'sign = 1 if bit == "1" else -1', "sign = 1", "a pattern for the other side"),
    (
        "entries",
        "    else:  # a corridor by its plan",
        '    elif part == "samples":  # a corridor by its plan',
        "a corridor whose plan does not keep to it",
    ),
    (
        "answer",
        '{"corridors": [], "doubt": [], "meta": None, **answer}',
        '{"doubt": [], "meta": None, **answer, "corridors": []}',
        "a corridor with a negative multiplier",
    ),
    (
        "entries",
        "in enumerate(entries):",
        'in enumerate(e for e in entries if e[:2] != ("corridors", 1)):',
        "a second corridor whose plan does not keep to it",
    ),
    (
        "question",
        "[x > 0 for x in",
        "[True for x in",
        "a goal reached by the network without ReLU only",
    ),
    (
        "question",
        'network["biases"], strict=True',
        'network["biases"], strict=False',
        "biases of another layer",
    ),
    (
        "question",
        'tube["edges"], self.lo, self.hi, strict=True',
        'tube["edges"], self.lo, self.hi, strict=False',
        "edges of a second axis",
    ),
    ("answer", "object_pairs_hook=unique, ", "", "a key twice"),
    ("answer", "parse_float=refuse, ", "", "a float in a part that is ignored"),
    ("answer", ", parse_constant=refuse", "", "a NaN in a part that is ignored"),
    (
        "errors",
        "map(min, positions, least)",
        "map(max, positions, least)",
        "a box of z for an end wider than the last interval",
    ),
    ("errors", "held = held and", "held = held or", "an error of a face outside the last interval"),
    (
        "hits",
        "inside_tube = all(",
        "inside_tube = any(",
        "an error of a point in one of two bins",
    ),
    ("hits", "strict = not only_touch", "strict = False and only_touch", "touching at a knot"),
    ("hits", "max(s - 1, 0) : s + 1", "max(s - 1, 0) : s", "touching at a knot"),
    ("errors", "if v == scaled and all(", "if all(", "an end whose way is another row's"),
    ("errors", " and all(m >= 0 for _, m in way)", "", "an end whose way is negative"),
    (
        "errors",
        "if own <= ahead",
        "if True",
        "touching with a template",
    ),
    (
        "plans",
        "for i in part.points:",
        "for i in part.points[:1]:",
        "contact of the second point only",
    ),
    (
        "no_plan",
        "hi[i]), pair, strict=True",
        "hi[i]), pair, strict=False",
        "one face missing",
    ),
    ("cells", "== 2", "== 3", "a safe leaf that fails between the corners of k"),
    (
        "cells",
        "    yield [(p, f) for p, f, _ in below] + on\n",
        "",
        "a safe leaf that fails between the corners of k",
    ),
    ("no_plan", "if all(holds(", "if any(holds(", "a hit at some vertices only"),
    (
        "no_plan",
        "serving = [(*integers(z), groups) for z in corners]",
        "serving = [(*integers(z), [sum(groups, [])]) for z in corners]",
        "a mixture that changes with k",
    ),
    ("bounds", "if x > 0:", "if x < 0:", "a false leaf by bounds"),
    ("bounds", "constant += x * height", "pass", "bounds that do not reach"),
    ("bounds", "min(x * a, x * b)", "max(x * a, x * b)", "a false leaf by bounds"),
    ("bounds", "line(least, -less, scale)", "line(least, -least, scale)", "a false leaf by bounds"),
    ("hits", "(1 - alpha, alpha)", "(alpha, 1 - alpha)", "a hit at the other knot"),
    ("hits", "x + weight * y for", "x + y for", "an error of a point without weight"),
]


@pytest.mark.soundness
@pytest.mark.parametrize("slip", SLIPS, ids=lambda slip: f"{slip[1]} -> {slip[2]}, {slip[3]}")
def test_slips_in_the_checker_are_noticed(slip, monkeypatch, tmp_path):
    name, right, wrong, case = slip
    assert SOURCES[name].count(right) == 1
    make, limits = CASES[case]
    assert rejection((make(), limits), tmp_path) is not None
    mutant = load_mutant(monkeypatch, tmp_path, name, SOURCES[name].replace(right, wrong))
    assert rejection((make(), limits), tmp_path, mutant) is None
