"""Premises: all that a sentence rests on, with its numbers, as one record that is hashed whole.

A sentence is printed from its premises and from nothing else; two things that meet (a claim and the
runs that are watched under it, a manoeuvre and the next one) meet through `agree`.
"""

import hashlib
import json
from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from parc_jax.checker.claim import ASSUMED, CHECKED, MEASURED
from parc_jax.common.errors import InputError, check_kind, is_text, shown

# checked: recomputed by the engine and both checkers; measured: counted in runs, or read off the
# thing itself, the record's word; assumed: nobody showed it
STANDINGS = (CHECKED, MEASURED, ASSUMED)
LONGEST = 120  # characters of a value that a message quotes


class Premise(NamedTuple):
    """One of them. standing: one of STANDINGS. value: text with its unit, a whole number, or a list
    of such; numbers that are not whole are spelled, so that files and hashes keep them.
    """

    name: str
    standing: str
    value: Any


@dataclass(frozen=True)
class Premises:
    """Entries by name, in the order in which they are told. Make it with `premises`."""

    entries: tuple[Premise, ...]

    @property
    def hash(self) -> str:
        """SHA-256 of the canonical JSON of all entries."""
        return hashlib.sha256(json.dumps(self.to_json(), sort_keys=True).encode()).hexdigest()

    def __getitem__(self, name: str) -> Any:
        """The value of an entry. Raises KeyError."""
        return self._by_name()[name].value

    def __contains__(self, name: str) -> bool:
        return name in self._by_name()

    def __iter__(self) -> Iterator[Premise]:
        return iter(self.entries)

    def to_json(self) -> list[list]:
        """Lists of name, standing and value."""
        return [list(entry) for entry in self.entries]

    def _by_name(self) -> dict[str, Premise]:
        return {entry.name: entry for entry in self.entries}


def premises(entries: Iterable[tuple[str, str, Any]]) -> Premises:
    """The record of entries (name, standing, value). Raises InputError for a name that stands there
    twice, an unknown standing, or a value that a file could not keep.
    """
    found = tuple(Premise(*entry) for entry in entries)
    names = [entry.name for entry in found]
    if len(set(names)) < len(names) or any(e.standing not in STANDINGS for e in found):
        raise InputError(
            f"premises: expected each name once, its standing one of {', '.join(STANDINGS)}; got "
            f"{[tuple(e[:2]) for e in found]}."
        )
    for entry in found:
        if not _keepable(entry.value):
            raise InputError(
                f"premises: expected {entry.name} as text, a whole number or a list of such; got "
                f"{entry.value!r:.80}."
            )
    return Premises(found)


def assumptions(call: str, given: Mapping[str, Any] | None) -> list[Premise]:
    """What a caller assumes, by name, each some text on one line. Raises InputError."""
    check_kind(f"{call}: assumed", {} if given is None else given, Mapping)
    for name, value in (given := dict(given or {})).items():
        said = all(is_text(x) and x.strip() for x in (name, text_of(value)))
        if not (said and _keepable(value)):
            raise InputError(
                f"{call}: expected assumed as some text by name; got {shown({name: value})}."
            )
    return [Premise(name, ASSUMED, value) for name, value in given.items()]


def agree(
    where: str, a: Premises, b: Premises, *, free: Container[str] = (), hint: str = ""
) -> None:
    """Refuse two records that meet and differ: every entry has one value in both.

    where: who asks, for the message. free: entries that may differ; the caller says why beside it.
    hint: what to try. Raises InputError, naming every entry that does not fit, with both values.
    """
    one, other = a._by_name(), b._by_name()
    faults = []
    for name in dict.fromkeys([*one, *other]):
        if name in free:
            continue
        values = [held[name].value if name in held else None for held in (one, other)]
        if values[0] != values[1]:
            faults.append(f"{name} is {_quoted(values[0])}, beside {_quoted(values[1])}")
    if faults:
        told = f"{where}: expected premises that agree; {'; '.join(faults)}."
        raise InputError(f"{told} {hint}".rstrip())


def text_of(value: Any) -> str:
    """A value for people."""
    return ", ".join(map(text_of, value)) if isinstance(value, list | tuple) else str(value)


def _quoted(value: Any) -> str:
    text = "not stated" if value is None else text_of(value) or "none"
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}…"


def _keepable(value: Any) -> bool:
    if isinstance(value, list | tuple):
        return all(map(_keepable, value))
    return isinstance(value, str) or type(value) is int
