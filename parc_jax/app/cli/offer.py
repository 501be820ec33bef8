"""Options of a command that are told elsewhere: the fields of a record, with their docstrings."""

import dataclasses
import importlib
import re
import types
import typing
from pathlib import Path
from typing import Any, NamedTuple

from parc_jax.common.options import told

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
