"""A fault on purpose: one place of the code, made wrong, and the test that must notice.

A place is named by what it means, a function, a class or a module ("question.moved_tube"), so code
may move without moving the table; files that are not Python are named by their path.
"""

import ast
import functools
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("parc_jax", "sims", "benchmarks")  # where places are looked for


class Span(NamedTuple):
    """Where a place stands: a file and its characters from `begin` up to `end`."""

    path: Path
    begin: int
    end: int


class Misfit(Exception):
    """A fault does not fit the code; says why in one phrase."""


@dataclass(frozen=True)
class Fault:
    """At `place`, the text `old`, which must stand there exactly once, becomes `new`.

    place: the end of a dotted name that only one module, class or function has; or a file.
    test: pytest node id of a test, or of all cases of a parametrised one, of which one must fail.
    """

    name: str
    place: str
    old: str
    new: str
    test: str

    def missing(self, root: Path = ROOT) -> str | None:
        """Why the fault does not fit the code, in one phrase; None when it does."""
        try:
            self.planted(root)
        except Misfit as why:
            return str(why)
        return None if _defined(root, self.test) else f"no test {self.test}"

    def planted(self, root: Path = ROOT) -> tuple[Path, str, str]:
        """The file with its text as it is and with the fault. Raises Misfit."""
        span = find(root, self.place)
        text = span.path.read_text()
        inside = text[span.begin : span.end]
        found = inside.count(self.old)
        if found != 1:
            raise Misfit(f"{self.place} holds its text {found} times, expected once")
        return (
            span.path,
            text,
            text[: span.begin] + inside.replace(self.old, self.new) + text[span.end :],
        )


def find(root: Path, place: str) -> Span:
    """Where a place stands. Raises Misfit where there is none, or more than one."""
    if "/" in place:
        path = root / place
        if not path.exists():
            raise Misfit(f"{place} does not exist")
        return Span(path, 0, len(path.read_text()))
    named = _places(root).get(place.rsplit(".", 1)[-1], ())
    found = [span for name, span in named if f".{name}".endswith(f".{place}")]
    if len(found) != 1:
        raise Misfit(f"{place} is the name of {len(found)} places, expected of one")
    return found[0]


@functools.cache
def _places(root: Path) -> dict[str, list[tuple[str, Span]]]:
    """(dotted name, where) of every module, class and function, by the last part of the name."""
    known: dict[str, list[tuple[str, Span]]] = {}
    for source in SOURCES:
        for path in sorted((root / source).rglob("*.py")):
            for name, span in places_of(path, root):
                known.setdefault(name.rsplit(".", 1)[-1], []).append((name, span))
    return known


def places_of(path: Path, root: Path) -> list[tuple[str, Span]]:
    """The module of a file and what it defines, functions inside of functions too."""
    text = path.read_text()
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    module = ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__")
    found = [(module, Span(path, 0, len(text)))]

    def visit(node, name: str) -> None:
        for child in ast.iter_child_nodes(node):
            inner = name
            if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                inner = f"{name}.{child.name}"
                first = min([child.lineno, *(d.lineno for d in child.decorator_list)])
                last = child.end_lineno or child.lineno
                found.append((inner, Span(path, starts[first - 1], starts[last])))
            visit(child, inner)

    visit(ast.parse(text), module)
    return found


def _defined(root: Path, test: str) -> bool:
    file, _, name = test.partition("::")
    path = root / file
    return path.exists() and f"def {name.split('::')[-1].split('[')[0]}(" in path.read_text()
