"""The public face: few names, in rooms, and each says what it is."""

import ast
import importlib
import inspect
import os
import pkgutil
import re
import subprocess
import sys
from operator import attrgetter
from pathlib import Path

import pytest
from needs import need

import parc_jax

MOST = 26  # names that a reader meets at once
ROOMS = ("drive", "exchange", "learning", "problem", "proof", "types")
NAMES = [name for name in parc_jax.__all__ if not inspect.ismodule(getattr(parc_jax, name))]
NAMES += [f"{room}.{name}" for room in ROOMS for name in getattr(parc_jax, room).__all__]


def test_names_are_few_and_sorted():
    for name in (*ROOMS, "figures"):
        package = getattr(parc_jax, name)
        assert package.__all__ == sorted(package.__all__) == dir(package)
    assert parc_jax.__all__ == sorted(parc_jax.__all__) == dir(parc_jax)
    assert 20 < len(parc_jax.__all__) <= MOST
    assert {*ROOMS, "figures"} == set(parc_jax.__all__) - set(NAMES)


def test_a_thing_has_one_name():
    """Nothing is offered twice, and nothing stands in the way of a file of its name."""
    things = [attrgetter(name)(parc_jax) for name in NAMES]
    assert len(set(map(id, things))) == len(things)
    for name in ("drive", "learning", "problem", "proof"):
        room = getattr(parc_jax, name)
        beside = Path(room.__file__).parent.iterdir()
        assert not {path.stem for path in beside} & set(room.__all__)


def undocumented(name: str) -> list[str]:
    """A public thing and its members, where they go by another name or have no docstring."""
    thing = attrgetter(name)(parc_jax)
    text = inspect.getdoc(thing) or ""
    said = len(text.split("\n")[0]) > 15 and text != inspect.getdoc(object)
    found = [] if said and thing.__name__ == name.rpartition(".")[-1] else [name]
    for attribute, member in vars(thing).items() if inspect.isclass(thing) else ():
        if attribute.startswith("_") or attribute == "replace":
            continue
        target = (
            member.fget if isinstance(member, property) else getattr(member, "__func__", member)
        )
        if inspect.isfunction(target) and not inspect.getdoc(target):
            found.append(f"{name}.{attribute}")
    return found


def test_every_name_loads_and_has_a_docstring():
    wrong = [one for name in NAMES for one in undocumented(name)]
    assert not wrong, "\n".join(wrong)


def test_every_name_that_is_written_of_the_package_is_there():
    """In code and on pages, whatever the extras that they need; in a room as well."""
    root = Path(__file__).parents[1]
    files = [
        path for room in ("sims", "benchmarks", "tests") for path in root.glob(f"{room}/**/*.py")
    ]
    files += [*root.glob("docs/examples/*"), *root.glob("docs/*.md"), root / "README.md"]
    # programs without an ending, not what Python left beside them
    files += [p for p in root.glob("benchmarks/suite/entries/*/*") if not p.suffix]
    written = re.compile(r"(?<![\w.`/])pj\.(\w+)(?:\.(\w+))?")
    missing = []
    for path in files:
        if path.name == "changelog.md" or not path.is_file():
            continue
        for name, inner in set(written.findall(path.read_text())):
            thing = getattr(parc_jax, name, None)
            whole = thing is not None and (not inner or hasattr(thing, inner))
            if not whole and not name.startswith("__"):
                missing.append(f"{path.relative_to(root)}: pj.{name}{inner and '.' + inner}")
    assert not missing, "\n".join(sorted(missing))


def test_every_name_that_is_imported_anywhere_is_there():
    """Also where a function imports it, which nothing else looks at before somebody calls it."""
    root, homes, lost, found = Path(__file__).parents[1], ("parc_jax", "sims", "benchmarks"), [], 0
    for path in sorted(path for home in homes for path in (root / home).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.ImportFrom) or node.level or not node.module:
                continue
            if node.module.split(".")[0] not in homes:
                continue
            found += 1
            try:
                module = importlib.import_module(node.module)
            except ImportError as error:  # of a foreign package that is not installed
                lost += [f"{path}: {error}"] if str(error.name).split(".")[0] in homes else []
                continue
            inside = {info.name for info in pkgutil.iter_modules(getattr(module, "__path__", ()))}
            names = (alias.name for alias in node.names)
            lost += [f"{path}: {n}" for n in names if n not in inside and not hasattr(module, n)]
    assert lost == [] and found > 1000


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'solve_everything'"):
        parc_jax.solve_everything  # noqa: B018


@pytest.mark.slow
def test_the_types_of_an_installed_package_are_seen(tmp_path):
    """From a folder of one's own, as installed (the gate installs an editable package): the types
    of the public names are known, and a wrong argument is found.
    """
    need("mypy")
    (tmp_path / "mine.py").write_text(
        "import parc_jax as pj\nmodel = pj.load('x.npz')\nreveal_type(model)\npj.Planner(3)\n"
    )
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "MYPYPATH")}
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--cache-dir", str(tmp_path / "cache"), "mine.py"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert 'Revealed type is "parc_jax.learning.model.TrajectoryModel"' in done.stdout, done.stdout
    assert 'has incompatible type "int"; expected "TrajectoryModel"' in done.stdout
