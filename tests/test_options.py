"""Each option is told once: a field of one record, whose docstring is all that is told of it."""

import ast
import dataclasses
import importlib
import inspect
import re
from pathlib import Path

import pytest

import parc_jax
from parc_jax.app import cli
from parc_jax.app.cli.options import Offer
from parc_jax.app.study.settings import Study
from parc_jax.common.errors import InputError
from parc_jax.common.options import Options, told
from parc_jax.problem import problem_file, scene_values
from parc_jax.problem.problem import Problem
from parc_jax.problem.uncertainty import Uncertainty
from parc_jax.safe_set.settings import Settings

ROOT = Path(parc_jax.__file__).parent
COMMANDS = tuple(cli.COMMANDS)


def declared(tree: ast.Module) -> list[str]:
    """Fields of records of options, and of the uncertainty, that carry a docstring."""
    found = []
    for kind in (node for node in tree.body if isinstance(node, ast.ClassDef)):
        for field, text in zip(kind.body, kind.body[1:], strict=False):
            if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr):
                found.append(field.target.id)
    return found


def records() -> list[type]:
    """All records of options, wherever they stand."""
    for path in ROOT.rglob("*.py"):
        if declared(ast.parse(path.read_text())):
            name = ".".join(path.relative_to(ROOT.parent).with_suffix("").parts)
            importlib.import_module(name)
    found, left = [Uncertainty], [Options]
    while left:
        kinds = left.pop().__subclasses__()
        found += [kind for kind in kinds if kind.__module__.startswith("parc_jax.")]
        left += kinds
    return found


def own_options(command: str) -> set[str]:
    """What a command tells itself, in its docstring."""
    function = cli.command(command)
    return set(re.findall(r"^    (\w+): ", inspect.getdoc(function), re.MULTILINE))


def test_no_option_is_declared_twice():
    fields = [f for p in ROOT.rglob("*.py") for f in declared(ast.parse(p.read_text()))]
    spelled = [
        f for f in fields if f not in {field.name for field in dataclasses.fields(Uncertainty)}
    ]
    assert len(fields) > 40 and len(set(spelled)) == len(spelled)
    one = 'class A:\n    n: int\n    "Runs."\n'
    assert declared(ast.parse(one + one)) == ["n", "n"]


def test_every_field_is_told_in_a_sentence():
    fields = {kind: {f.name for f in dataclasses.fields(kind)} for kind in records()}
    assert len(fields) > 10
    wrong = [kind for kind, names in fields.items() if not names or set(told(kind)) != names]
    texts = [text for kind in fields for text in told(kind).values()]
    wrong += [text for text in texts if not re.fullmatch(r'["A-Z].*[.\]]', text, re.S)]
    assert not wrong, wrong


def test_a_command_tells_only_what_no_record_has():
    fields = {name for kind in records() for name in told(kind)}
    assert [(c, own_options(c) & fields) for c in COMMANDS if own_options(c) & fields] == []


def test_every_option_of_the_shell_is_of_a_record_or_of_its_command():
    for command in COMMANDS:
        function = cli.command(command)
        for parameter in inspect.signature(function).parameters.values():
            hints = getattr(parameter.annotation, "__metadata__", ())
            offered = [hint for hint in hints if isinstance(hint, Offer)]
            assert offered or parameter.name in own_options(command), (command, parameter.name)
            for offer in offered:
                options = offer.options().values()
                kind = offer.kind()
                parts = [field.default for field in dataclasses.fields(kind)]
                inner = [told(type(part)) for part in parts if isinstance(part, Options)]
                known = set(told(kind)).union(*inner)
                assert options and {o.field for o in options} <= known


def test_the_keys_of_a_scene_file_are_the_fields_of_its_record():
    assert scene_values.UNCERTAINTY_ENTRIES == tuple(told(Uncertainty))
    of_problem = {field.name for field in dataclasses.fields(Problem)}
    assert set(problem_file.ENTRIES) - of_problem == {"places"}
    assert of_problem - set(problem_file.ENTRIES) == {"spans"}  # `steps` of each obstacle


def test_a_study_is_what_its_parts_are_made_of():
    study = Study().replace(eps=0.01, work=0.5, hidden=())
    assert study.settings == Settings(work=0.5) and study.hidden == ()
    asked = study.claims
    assert (asked.eps, asked.discard, asked.profile_runs) == (0.01, "most", 0)
    with pytest.raises(InputError, match=r"expected fields among .*; got 'runs'"):
        study.replace(runs=3)
