"""When would the tests notice? `python -m benchmarks.attacks levels [--list]`.

For every planted fault the level at which its test runs: default (README's test
command), gate (`.ci/run`: slow tests too), night (`.ci/nightly`: campaigns too). Read from the
markers, without running anything; that the tests do notice is shown by `faults`.
"""

import ast
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import tyro

from benchmarks.attacks.fault import ROOT
from benchmarks.attacks.faults import FAULTS

LEVELS = ("default", "gate", "night")
MARKS = {"slow": 1, "night": 2}  # markers of pyproject.toml
AT_LEAST = {"default": 0.90, "gate": 1.0, "night": 1.0}  # share of faults noticed up to a level


@dataclass(frozen=True)
class Options:
    """What to print."""

    list: bool = False
    """A line per fault."""


def level_of_test(test: str, root: Path = ROOT) -> int:
    """Index in LEVELS of a node id without its cases: a parametrised test has the level of its
    first case. Raises KeyError for a test that is not there.
    """
    file, _, name = test.partition("::")
    whole, tests = _levels(root / file)
    return max(whole, tests[name.split("[")[0]])


def shares(faults=FAULTS, root: Path = ROOT) -> dict[str, float]:
    """The share of faults that are noticed up to each level."""
    counts = Counter(level_of_test(fault.test, root) for fault in faults)
    upto = [sum(counts[i] for i in range(level + 1)) for level in range(len(LEVELS))]
    return {name: n / len(faults) for name, n in zip(LEVELS, upto, strict=True)}


@cache
def _levels(path: Path) -> tuple[int, dict[str, int]]:
    """Level of a whole file (by its pytestmark), and of each test by its decorators."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    marks = [
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "pytestmark"
    ]
    whole = max((_level(mark) for mark in marks), default=0)
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    return whole, {
        node.name: max(map(_level, _outer(node.decorator_list)), default=0) for node in functions
    }


def _outer(decorators) -> list[ast.expr]:
    """Decorators but parametrize, whose marks belong to single cases."""
    return [d for d in decorators if "parametrize" not in ast.unparse(d).split("(")[0]]


def _level(expression: ast.expr) -> int:
    """The highest marker that is named in an expression such as [pytest.mark.slow, NEEDED]."""
    named = [node.attr for node in ast.walk(expression) if isinstance(node, ast.Attribute)]
    return max((MARKS.get(name, 0) for name in named), default=0)


def main(arguments: list[str]) -> int:
    """The command. Exit code 1 when a share is too small."""
    options = tyro.cli(Options, args=arguments, description=__doc__)
    if options.list:
        for fault in FAULTS:
            print(f"| {fault.name} | {LEVELS[level_of_test(fault.test)]} |")
    found = shares()
    for name, share in found.items():
        number, least = round(share * len(FAULTS)), AT_LEAST[name]
        print(f"{name:<8} {number} of {len(FAULTS)} faults, {share:.0%} (at least {least:.0%})")
    return int(any(found[name] < AT_LEAST[name] for name in LEVELS))
