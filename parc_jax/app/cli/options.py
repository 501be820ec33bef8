"""Options of the commands, from the fields of records."""

import importlib
import inspect
import re
import types
import typing
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, NamedTuple

from parc_jax.common.options import Options, told

SCALARS = (int, float, str, bool, Path)
METAVARS = {int: "N", float: "X", str: "NAME", Path: "PATH"}


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


@dataclass(frozen=True)
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
    named: dict[str, str] = field(default_factory=dict)
    kinds: dict[str, Any] = field(default_factory=dict)

    def kind(self) -> type:
        """The record."""
        module, _, name = self.record.rpartition(".")
        return getattr(importlib.import_module(f"parc_jax.{module}"), name)

    def options(self) -> dict[str, Option]:
        """The options by their names in the shell."""
        return self._of(self.kind())

    def _of(self, kind: type, record: Options | None = None) -> dict[str, Option]:
        """Those of a kind of record, and of records in it. record: with its defaults."""
        options: dict[str, Option] = {}
        hints, texts = typing.get_type_hints(kind) | self.kinds, told(kind)
        for name, default in ((one.name, one.default) for one in fields(kind)):
            if isinstance(default, Options):
                options |= self._of(type(default), default)
                continue
            default = default if record is None else getattr(record, name)
            hint = shell_type(hints[name])
            if hint is None or name in self.but or name not in (self.only or hints):
                continue
            # citations of theorems are for readers of the source
            text = re.sub(r" \[T\d[^]]*\]", "", texts[name])
            if self.left_out is not None:
                text, default, hint = _with_default(text, default, self.left_out), None, hint | None
            shown = self.named.get(name, name.removesuffix("_s"))
            options[shown] = Option(name, hint, default, text)
        return options

    def made(self, given: dict[str, Any]) -> Any:
        """The command's parameter from values by names of the shell, which are taken out of
        `given`. Raises InputError.
        """
        values = {one.field: given.pop(name) for name, one in self.options().items()}
        if self.left_out is None:
            return self.kind()(**values)
        return {field: value for field, value in values.items() if value is not None}


def _is_union(hint) -> bool:
    return isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union


def shell_type(hint) -> Any:
    """The part of a type that a shell can read; None without one."""
    if _is_union(hint):
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
        words = " ".join(map(_word, default if isinstance(default, tuple) else (default,)))
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
    parameters, offers = [], {}
    for one in inspect.signature(command).parameters.values():
        offer = next((x for x in typing.get_args(one.annotation)[1:] if isinstance(x, Offer)), None)
        if offer is None:
            name = one.name.upper() if one.kind is one.POSITIONAL_ONLY else None
            parameters.append(_shown(one, name=name))
        elif with_offers:
            offers[one.name] = offer
            for name, (_, kind, default, text) in offer.options().items():
                option = inspect.Parameter(name, one.kind, default=default, annotation=kind)
                parameters.append(_shown(option, text))

    def shown(*arguments, **options):
        if "cache" in options:  # of commands that compile
            from parc_jax.app.study.cache import keep_compiled, spare_memory

            spare_memory()
            if options["cache"]:
                keep_compiled()
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
    origin = typing.get_origin(hint)
    parts = [part for part in typing.get_args(hint) if part not in (types.NoneType, ...)]
    if _is_union(hint):
        words = [metavar_of(part) for part in parts if part is not bool] or ["True|False"]
        return None if None in words else "|".join(map(str, words))
    if origin is tuple and (one := metavar_of(parts[0])) is not None:
        return f"{one} {one} ..." if one.isalpha() else f"{{{one}}} ..."
    return "|".join(map(str, parts)) if origin is typing.Literal else None
