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

from parc_jax.app.cli.offer import Offer

METAVARS = {int: "N", float: "X", str: "NAME", Path: "PATH"}
FRAME = "╭│╰"  # what the lines of a box begin with; those are wrapped already
NARROWEST = 40


def readable(command: Callable, whole: bool = True) -> Callable:
    """The same command for the parser: `--bins N N ...` where it would say
    {None}|{[INT [INT ...]]}, no "(default: None)", help texts in one piece, which it breaks where
    the terminal ends, and every `Offer` as its options; without these unless `whole`.
    """
    hints = typing.get_type_hints(command, include_extras=True)
    parameters, offers = [], {}
    for parameter in inspect.signature(command).parameters.values():
        hint = hints[parameter.name]
        offer = next((x for x in typing.get_args(hint)[1:] if isinstance(x, Offer)), None)
        if offer is None:
            name = parameter.name.upper() if parameter.kind is parameter.POSITIONAL_ONLY else None
            parameters.append(_shown(parameter.replace(annotation=hint), name))
        elif whole:
            offers[parameter.name] = offer
            for name, (_, kind, default, said) in offer.options().items():
                option = inspect.Parameter(
                    name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind
                )
                parameters.append(_shown(option, said=said))

    def shown(*arguments, **options):
        records = {name: offer.made(options) for name, offer in offers.items()}
        return command(*arguments, **options, **records)

    shown.__name__ = command.__name__
    shown.__doc__ = re.sub(r"\n {12}(?=\S)", " ", command.__doc__ or "")
    shown.__signature__ = inspect.Signature(parameters)
    shown.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return shown


def _shown(
    parameter: inspect.Parameter, name: str | None = None, said: str | None = None
) -> inspect.Parameter:
    """The parameter with words for its values, and help where its command does not tell it."""
    import tyro

    words = tyro.conf.arg(
        metavar=name or metavar_of(parameter.annotation),
        help=said,
        # where it is None the help text says what happens
        help_behavior_hint="" if parameter.default is None else None,
    )
    return parameter.replace(annotation=typing.Annotated[parameter.annotation, words])


def metavar_of(hint) -> str | None:
    """A short word for the values of an option; None where the parser's own is good."""
    if hint in METAVARS:
        return METAVARS[hint]
    parts = [part for part in typing.get_args(hint) if part not in (types.NoneType, ...)]
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        if parts == [bool]:
            return "True|False"
        words = [metavar_of(part) for part in parts if part is not bool]
        return None if not words or None in words else "|".join(map(str, words))
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
