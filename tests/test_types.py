"""Functions say the types of their parameters: how many do not is counted, and may only fall."""

import ast
from pathlib import Path

import parc_jax

ROOT = Path(parc_jax.__file__).parent
MOST = 820  # parameters without a type, outside of rooms that have all
# where none is left
WHOLE = (
    "answer/looks common/errors learning/bound learning/network/maps problem/world "
    "safe_set/settings safe_set/separation safe_set/verdict safe_set/corridors proof/absence "
    "proof/regions drive/local drive/loop"
).split()
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


def untyped_by_file() -> dict[str, list[str]]:
    return {
        path.relative_to(ROOT).as_posix(): [
            f"{path.name}: {name}" for name in untyped(path.read_text(encoding="utf-8"))
        ]
        for path in sorted(ROOT.rglob("*.py"))
    }


def test_parameters_have_types():
    """Whoever adds a parameter types it, and lowers MOST by what else he typed."""
    found = untyped_by_file()
    whole = [n for file, names in found.items() if file.startswith(tuple(WHOLE)) for n in names]
    assert len(whole) <= BEFORE_IT_IS_MADE, whole
    rest = sum(map(len, found.values())) - len(whole)
    assert MOST - 40 < rest <= MOST


def test_a_parameter_without_a_type_is_seen():
    text = "class A:\n    def f(self, x: int, y, *, z=1): ...\n"
    assert untyped(text) == ["f(y)", "f(z)"]
