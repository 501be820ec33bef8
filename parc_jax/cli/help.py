"""Help that reads well on a narrow terminal: short words for values, wrapped paragraphs."""

import contextlib
import inspect
import io
import re
import shutil
import sys
import textwrap
import types
import typing
from collections.abc import Callable, Iterator
from pathlib import Path

METAVARS = {int: "N", float: "X", str: "NAME", Path: "PATH"}
FRAME = "╭│╰"  # what the lines of a box begin with; those are wrapped already
NARROWEST = 40


def readable(command: Callable) -> Callable:
    """The same command for the parser: `--bins N N ...` where it would say
    {None}|{[INT [INT ...]]}, no "(default: None)", and help texts in one piece, which it breaks
    where the terminal ends.
    """
    import tyro

    hints = typing.get_type_hints(command)
    signature = inspect.signature(command)
    parameters = []
    for parameter in signature.parameters.values():
        hint = hints[parameter.name]
        metavar = metavar_of(hint)
        if parameter.kind is parameter.POSITIONAL_ONLY:
            metavar = parameter.name.upper()
        left_out = "" if parameter.default is None else None  # the help text says what happens
        hint = typing.Annotated[hint, tyro.conf.arg(metavar=metavar, help_behavior_hint=left_out)]
        parameters.append(parameter.replace(annotation=hint))

    def shown(*arguments, **options):
        return command(*arguments, **options)

    shown.__name__ = command.__name__
    shown.__doc__ = re.sub(r"\n {12}(?=\S)", " ", command.__doc__ or "")
    shown.__signature__ = signature.replace(parameters=parameters)
    shown.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return shown


def metavar_of(hint) -> str | None:
    """A short word for the values of an option; None where the parser's own is good."""
    if hint in METAVARS:
        return METAVARS[hint]
    parts = [part for part in typing.get_args(hint) if part not in (types.NoneType, ...)]
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        return metavar_of(parts[0]) if len(parts) == 1 else None
    if typing.get_origin(hint) is tuple:
        one = metavar_of(parts[0])
        if one is None:
            return None
        return f"{one} {one} ..." if one.isalpha() else f"{{{one}}} ..."
    if typing.get_origin(hint) is typing.Literal:
        return "|".join(map(str, parts))
    return None


@contextlib.contextmanager
def wrapped() -> Iterator[None]:
    """Long lines outside of boxes are broken at the terminal's width, also when the block exits."""
    held = io.TextIOWrapper(io.BytesIO(), encoding=sys.stdout.encoding)
    try:
        with contextlib.redirect_stdout(held):
            yield
    finally:
        width = max(NARROWEST, shutil.get_terminal_size().columns)
        held.seek(0)
        for line in held.read().splitlines():
            whole = line[:1] in FRAME or len(line) <= width
            print(line if whole else textwrap.fill(line, width, break_on_hyphens=False))


def fitted(text: str) -> str:
    """The text with its sentences broken at the terminal's width; tables, and what goes elsewhere
    than to a terminal, stay as they are.
    """
    if not sys.stdout.isatty():
        return text
    width = max(NARROWEST, shutil.get_terminal_size().columns)
    return "\n".join(
        line if "  " in line.strip() else textwrap.fill(line, width, break_on_hyphens=False)
        for line in text.split("\n")
    )
