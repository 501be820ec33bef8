"""Writes api.md, and the rooms of architecture.md, from docstrings: `python docs/make_api.py`."""

import ast
import dataclasses
import enum
import importlib
import inspect
import re
from pathlib import Path

import parc_jax
from parc_jax.common.options import told

BEGIN, END = "<!-- rooms: written by docs/make_api.py -->", "<!-- end of rooms -->"
ROOMS = (
    "learning",
    "problem",
    "proof",
    "drive",
    "types",
    "exchange",
)
FURTHER = {
    "Records of options": (
        "learning.bound.settings",
        "learning.network.fit",
        "app.study.settings",
    ),
}


def page() -> str:
    """The whole page."""
    parts = ["# API", "Written by `python docs/make_api.py` from the docstrings; do not edit."]
    parts += ["## parc_jax", "`import parc_jax as pj` offers these names."]
    parts += offered("pj", parc_jax)
    for room in ROOMS:
        module = getattr(parc_jax, room)
        parts += [f"## pj.{room}", inspect.getdoc(module), *offered(f"pj.{room}", module)]
    for title, modules in FURTHER.items():
        parts.append(f"## {title}")
        for name in modules:
            module = importlib.import_module(f"parc_jax.{name}")
            parts.append(f"### parc_jax.{name}\n\n{inspect.getdoc(module)}")
            own = [
                (n, thing)
                for n, thing in vars(module).items()
                if getattr(thing, "__module__", "") == module.__name__
            ]
            parts += [
                entry(n, thing) for n, thing in own if not n.startswith("_") and callable(thing)
            ]
    return "\n\n".join(parts) + "\n"


def offered(name: str, package) -> list[str]:
    """The entries of all that a package offers but rooms."""
    things = {own: getattr(package, own) for own in package.__all__}
    return [entry(f"{name}.{own}", x) for own, x in things.items() if not inspect.ismodule(x)]


def rooms() -> list[tuple[str, str]]:
    """Every room and the sentence that its docstring begins with, in the order of imports."""
    layers = Path(__file__).parents[1] / "tests" / "test_layers.py"
    order = re.search(r"^ORDER = (\(.*?^\))", layers.read_text(encoding="utf-8"), re.M | re.S)
    home = Path(parc_jax.__file__).parent
    found = []
    for name in ast.literal_eval(order[1]):
        inner = sorted(path.parent.relative_to(home) for path in home.glob(f"{name}/*/__init__.py"))
        found += [name, *(path.as_posix() for path in inner if path.name != "proved")]
    return [(name, sentence(name)) for name in found]


def sentence(room: str) -> str:
    """The first sentence of a room's docstring, in one line; nothing where there is none."""
    home = Path(parc_jax.__file__).parent / room
    home = home / "__init__.py" if home.is_dir() else home.with_suffix(".py")
    text = ast.get_docstring(ast.parse(home.read_text(encoding="utf-8"))) or ""
    return re.match(r"(.*?\.(?= |$)|)", " ".join(text.split()))[1]


def with_rooms(text: str) -> str:
    """The text of architecture.md with the table of rooms as they are today."""
    rows = [f"| `{name}` | {said} |" for name, said in rooms()]
    table = "\n".join(["| room | what happens in it |", "|---|---|", *rows])
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    return f"{before}{BEGIN}\n\n{table}\n\n{END}{after}"


def entry(name: str, thing) -> str:
    """One name: signature, docstring, public methods."""
    lines = [
        f"#### `{name}`",
        "```text",
        signature(name.rsplit(".", 1)[-1], thing),
        "```",
        block(thing),
    ]
    if dataclasses.is_dataclass(thing):
        lines += [f"* `{field}`: {text}" for field, text in told(thing).items()]
    if inspect.isclass(thing):
        for own, member in members(thing).items():
            target = (
                member.fget if isinstance(member, property) else getattr(member, "__func__", member)
            )
            if (
                own.startswith("_")
                or own == "replace"
                or not (callable(target) and inspect.getdoc(target))
            ):
                continue
            shown = own if isinstance(member, property) else signature(own, target)
            lines.append(f"* `{shown}`: {' '.join(inspect.getdoc(target).split())}")
    return "\n".join(lines)


def members(kind: type) -> dict:
    """What a class defines, and before it what it has from other classes of parc_jax."""
    ours = [c for c in reversed(kind.__mro__) if c.__module__.startswith("parc_jax.")]
    return {own: member for c in ours for own, member in vars(c).items()}


def signature(name: str, thing) -> str:
    """name(parameters) with defaults, without annotations: shapes and units are in the
    docstring.
    """
    if isinstance(thing, enum.EnumType):  # made by nobody; Python's versions tell its class apart
        return name
    try:
        found = inspect.signature(thing)
    except (TypeError, ValueError):
        return name
    bare = [
        p.replace(annotation=inspect.Parameter.empty)
        for p in found.parameters.values()
        if p.name != "self"
    ]
    return name + str(found.replace(parameters=bare, return_annotation=inspect.Signature.empty))


def block(thing) -> str:
    """The docstring as text, so that its symbols stay as they are."""
    return "```text\n" + (inspect.getdoc(thing) or "") + "\n```\n"


if __name__ == "__main__":
    Path(__file__).with_name("api.md").write_text(page(), encoding="utf-8")
    house = Path(__file__).with_name("architecture.md")
    house.write_text(with_rooms(house.read_text(encoding="utf-8")), encoding="utf-8")
