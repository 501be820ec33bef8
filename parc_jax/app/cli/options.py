"""Options of the commands, from the fields of records, and their help on a narrow terminal."""

import contextlib
import dataclasses
import importlib
import inspect
import io
import re
import shutil
import sys
import textwrap
import types
import typing
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from parc_jax.common.options import Options, told

SCALARS = (int, float, str, bool, Path)
METAVARS = {int: "N", float: "X", str: "NAME", Path: "PATH"}
FRAME = "╭│╰"  # first letters of the lines of a box, which are wrapped already
NARROWEST = 40


@dataclass(frozen=True)
class Shell(Options):
    """Options that most commands have."""

    seed: int = 0
    """Everything random follows from it."""
    quiet: bool = False
    """No progress bars, and as few words as there can be."""
    json: bool = False
    """Print the result as JSON."""
    cache: bool = True
    """Keep compiled programs in the user's cache folder."""

    def __post_init__(self) -> None:
        from parc_jax.common.keys import check_seed

        check_seed(self.seed)


class Option(NamedTuple):
    """One option. field: of the record. kind: its type in the shell. text: its help."""

    field: str
    kind: Any
    default: Any
    text: str


@dataclasses.dataclass(frozen=True)
class Offer:
    """Annotates a parameter of a command: its options are the fields of a record with a type that
    the shell can read, named as there but for the _s of seconds.

    record: "module.Class" below parc_jax, loaded on first use.
    left_out: None: the parameter is the record, with its defaults. Else it is a dict of the given
        options, and these words name the source of the others.
    only: the fields on offer; () = all. but: not these.
    named: other names in the shell. kinds: other types there.
    """

    record: str
    left_out: str | None = None
    only: tuple[str, ...] = ()
    but: tuple[str, ...] = ()
    named: dict[str, str] = dataclasses.field(default_factory=dict)
    kinds: dict[str, Any] = dataclasses.field(default_factory=dict)

    def kind(self) -> type:
        """The record."""
        module, _, name = self.record.rpartition(".")
        return getattr(importlib.import_module(f"parc_jax.{module}"), name)

    def options(self) -> dict[str, Option]:
        """The options by their names in the shell."""
        kind = self.kind()
        hints = typing.get_type_hints(kind) | self.kinds
        options = {}
        for field in dataclasses.fields(kind):
            hint = shell_type(hints[field.name])
            on_offer = field.name not in self.but and field.name in (self.only or hints)
            if hint is None or not on_offer:
                continue
            name = field.name.removesuffix("_s")
            # citations of theorems are for readers of the source
            text = re.sub(r" \[T\d[^]]*\]", "", told(kind)[field.name])
            default = field.default
            if self.left_out is not None:
                text, default, hint = _with_default(text, default, self.left_out), None, hint | None
            options[self.named.get(field.name, name)] = Option(field.name, hint, default, text)
        return options

    def made(self, given: dict[str, Any]) -> Any:
        """The command's parameter from values by names of the shell, which are taken out of
        `given`. Raises InputError.
        """
        values = {option.field: given.pop(name) for name, option in self.options().items()}
        if self.left_out is None:
            return self.kind()(**values)
        return {field: value for field, value in values.items() if value is not None}


def shell_type(hint) -> Any:
    """The part of a type that a shell can read; None without one."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        plain = [part for part in typing.get_args(hint) if shell_type(part) is not None]
        return typing.Union[*plain] if set(plain) - {types.NoneType} else None
    origin, parts = typing.get_origin(hint), typing.get_args(hint)
    listed = origin is tuple and parts[0] in SCALARS
    fine = hint in (*SCALARS, types.NoneType) or origin is typing.Literal or listed
    return hint if fine else None


def _with_default(help_text: str, default, whose: str) -> str:
    """The help of an option that may be left out, with its default, or the words there for None."""
    text, _, words = help_text.partition(" Default: ")
    if default not in (None, ()):
        each = default if isinstance(default, tuple) else (default,)
        words = " ".join(_word(value) for value in each)
    words = words.removesuffix(".")
    return f"{text} Default: {whose}{words}." if words else text


def _word(value) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:,}" if isinstance(value, int | float) else str(value)


def readable(command: Callable, with_offers: bool = True) -> Callable:
    """The command for the parser, with short value names and unbroken help texts.

    `--bins N N ...` in place of {None}|{[INT [INT ...]]}, no "(default: None)"; every `Offer` is
    replaced by its options, or, unless `with_offers`, left out.
    """
    hints = typing.get_type_hints(command, include_extras=True)
    parameters, offers = [], {}
    for parameter in inspect.signature(command).parameters.values():
        hint = hints[parameter.name]
        offer = next((x for x in typing.get_args(hint)[1:] if isinstance(x, Offer)), None)
        if offer is None:
            name = parameter.name.upper() if parameter.kind is parameter.POSITIONAL_ONLY else None
            parameters.append(_shown(parameter.replace(annotation=hint), name=name))
        elif with_offers:
            offers[parameter.name] = offer
            for name, (_, kind, default, text) in offer.options().items():
                option = inspect.Parameter(
                    name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind
                )
                parameters.append(_shown(option, text))

    def shown(*arguments, **options):
        records = {name: offer.made(options) for name, offer in offers.items()}
        return command(*arguments, **options, **records)

    shown.__name__ = command.__name__
    shown.__doc__ = re.sub(r"\n {12}(?=\S)", " ", command.__doc__ or "")
    shown.__signature__ = inspect.Signature(parameters)
    shown.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return shown


def _shown(
    parameter: inspect.Parameter, text: str | None = None, name: str | None = None
) -> inspect.Parameter:
    """The parameter with a short name of its values, and the help of an option of a record."""
    import tyro

    words = tyro.conf.arg(
        metavar=name or metavar_of(parameter.annotation),
        help=text,
        # of None the help text says the meaning
        help_behavior_hint="" if parameter.default is None else None,
    )
    return parameter.replace(annotation=typing.Annotated[parameter.annotation, words])


def metavar_of(hint) -> str | None:
    """A short word for the values of an option; None to leave that of the parser."""
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
            fits = line[:1] in FRAME or len(line) <= width
            print(line if fits else textwrap.fill(line, width, break_on_hyphens=False))


def fitted(text: str) -> str:
    """The text with its sentences broken at the width of the terminal; tables, and text for
    anything but a terminal, stay as they are.
    """
    if not sys.stdout.isatty():
        return text
    width = max(NARROWEST, shutil.get_terminal_size().columns)
    return "\n".join(
        line if "  " in line.strip() else textwrap.fill(line, width, break_on_hyphens=False)
        for line in text.split("\n")
    )
