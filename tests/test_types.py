"""Functions say the types of their parameters: how many do not is counted, and may only fall."""

import ast
from pathlib import Path

import parc_jax

ROOT = Path(parc_jax.__file__).parent
MOST = 1125  # parameters without a type, outside of rooms that have all
# rooms where none is left
WHOLE = set("errors settings world pwa claim separation verdict cover no_plan local loop".split())
BEFORE_IT_IS_MADE = 2  # of pwa: a table is told to what it is made with, whose file comes first


def untyped(text: str) -> list[str]:
    """function(parameter) of every parameter without a type; `self` and `cls` need none."""
    found = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
            bare = [a.arg for a in given if a.annotation is None and a.arg not in ("self", "cls")]
            found += [f"{node.name}({name})" for name in bare]
    return found


def untyped_by_room() -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for path in sorted(ROOT.rglob("*.py")):
        room = path.relative_to(ROOT).with_suffix("").parts[0]
        names = [f"{path.name}: {name}" for name in untyped(path.read_text(encoding="utf-8"))]
        found[room] = found.get(room, []) + names
    return found


def test_parameters_have_types():
    """Whoever adds a parameter types it, and lowers MOST by what else he typed."""
    found = untyped_by_room()
    whole = [name for room in WHOLE for name in found[room]]
    assert len(whole) <= BEFORE_IT_IS_MADE, whole
    rest = sum(len(names) for room, names in found.items() if room not in WHOLE)
    assert MOST - 40 < rest <= MOST


def test_a_parameter_without_a_type_is_seen():
    text = "class A:\n    def f(self, x: int, y, *, z=1): ...\n"
    assert untyped(text) == ["f(y)", "f(z)"]
