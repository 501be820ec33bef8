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


@dataclass(frozen=True)
class Shell(Options):
    """How a command runs, whatever it does."""

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


SCALARS = (int, float, str, bool, Path)


class Option(NamedTuple):
    """One option. field: of the record. kind: of its value in the shell. said: its help."""

    field: str
    kind: Any
    default: Any
    said: str


@dataclasses.dataclass(frozen=True)
class Offer:
    """Annotates a parameter of a command: its options are the fields of a record that the shell can
    spell, named as there but for the _s of seconds.

    record: "module.Class" below parc_jax; loaded when the command is asked for.
    left_out: None: the parameter is the record, with its own defaults. Else a dict of what was
        given, and these words say whose value counts where nothing was.
    only: the fields on offer; () = all. but: not these. named: other names in the shell. kinds:
        other kinds of value there.
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
        found = {}
        for field in dataclasses.fields(kind):
            hint = spelled(hints[field.name])
            on_offer = field.name not in self.but and field.name in (self.only or hints)
            if hint is None or not on_offer:
                continue
            name = field.name.removesuffix("_s")
            said = re.sub(r" \[T\d[^]]*\]", "", told(kind)[field.name])
            default = field.default
            if self.left_out is not None:
                said, default, hint = _told_default(said, default, self.left_out), None, hint | None
            found[self.named.get(field.name, name)] = Option(field.name, hint, default, said)
        return found

    def made(self, given: dict[str, Any]) -> Any:
        """What the command's parameter is, from values by names of the shell, which are taken out
        of `given`. Raises InputError.
        """
        values = {option.field: given.pop(name) for name, option in self.options().items()}
        if self.left_out is None:
            return self.kind()(**values)
        return {field: value for field, value in values.items() if value is not None}


def spelled(hint) -> Any:
    """What of a kind of value can be spelled in a shell; None for nothing of it."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        plain = [part for part in typing.get_args(hint) if spelled(part) is not None]
        return typing.Union[*plain] if set(plain) - {types.NoneType} else None
    origin, parts = typing.get_origin(hint), typing.get_args(hint)
    listed = origin is tuple and parts[0] in SCALARS
    fine = hint in (*SCALARS, types.NoneType) or origin is typing.Literal or listed
    return hint if fine else None


def _told_default(said: str, default, whose: str) -> str:
    """The help of an option that may be left out, with what is taken then: the default, or what the
    help says of None.
    """
    text, _, words = said.partition(" Default: ")
    if default not in (None, ()):
        each = default if isinstance(default, tuple) else (default,)
        words = " ".join(_word(value) for value in each)
    words = words.removesuffix(".")
    return f"{text} Default: {whose}{words}." if words else text


def _word(value) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:,}" if isinstance(value, int | float) else str(value)


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
