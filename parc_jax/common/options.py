"""Records of options: each option is one field of one frozen dataclass, and the docstring under it
is its only description: in the shell's help, on the page of the API, in the source.
"""

import ast
import dataclasses
import functools
import inspect
import itertools
import textwrap
from collections.abc import Collection
from typing import Self

from parc_jax.common.errors import InputError


class Options:
    """Base of the records. Values without meaning are refused where a record is made."""

    def __post_init__(self) -> None:
        """Refuse values without meaning; records extend it. Raises InputError."""

    def replace(self, **changes) -> Self:
        """The same but for the given fields, or fields of the records in it. Raises InputError."""
        known = [f.name for f in dataclasses.fields(self)]  # type: ignore[arg-type]
        for name in known[:]:
            part = changes.get(name, getattr(self, name))
            if isinstance(part, Options):
                inner = [f.name for f in dataclasses.fields(part)]  # type: ignore[arg-type]
                given = {one: changes.pop(one) for one in inner if one in changes}
                known += inner
                changes |= {name: part.replace(**given)} if given else {}
        if unknown := sorted(set(changes) - set(known)):
            raise InputError(
                f"settings: expected fields among {', '.join(known)}; got {unknown[0]!r}."
            )
        return dataclasses.replace(self, **changes)  # type: ignore[type-var]


def refuse_unused(record: Options, names: Collection[str], why: str, told: Collection[str]) -> None:
    """Refuse fields that would change nothing, told or not as by default. Raises InputError."""
    own, usual = vars(record), vars(type(record)())
    if given := [x for x in names if x in told or repr(own[x]) != repr(usual[x])]:
        raise InputError(f"{', '.join(given)}: expected no such option {why}. Leave it out.")


def part_of(record: Options, kind: type) -> dict:
    """The values of a record for the fields of another kind, all of which it has."""
    return {f.name: getattr(record, f.name) for f in dataclasses.fields(kind)}


@functools.cache
def told(kind: type) -> dict[str, str]:
    """The docstring under each field of a record, inherited ones too, on one line."""
    found = {}
    for base in reversed(kind.__mro__):
        if dataclasses.is_dataclass(base):
            tree = ast.parse(textwrap.dedent(inspect.getsource(base)))
            for field, text in itertools.pairwise(tree.body[0].body):  # type: ignore[attr-defined]
                if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr):
                    words = ast.literal_eval(text.value).split()
                    found[field.target.id] = " ".join(words)  # type: ignore[union-attr]
    return found
