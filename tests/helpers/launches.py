"""How many programs a call runs, how many operations these launch, and how many arrays of the host
they are given: what an accelerator would pay for, counted on any machine.

An operation is an instruction of a compiled program after fusion; in a loop it counts as often as
the loop is known to run, once where that depends on values. Of a branch the longest way counts.
"""

import re
from contextlib import contextmanager
from functools import lru_cache
from typing import NamedTuple

import jax
from jax._src import pjit
from jax._src.interpreters import pxla

# instructions that launch nothing
FREE = {"parameter", "constant", "tuple", "get-tuple-element", "bitcast", "after-all", "copy-done"}
_INSTRUCTION = re.compile(r"^\s+(?:ROOT )?%?[\w.-]+ = (?:\([^)]*\)|\S+) ([\w-]+)\(")
_COMPUTATION = re.compile(r"^(ENTRY )?%?([\w.-]+) .*\{$")
_TRIPS = re.compile(r'"known_trip_count":\{"n":"(\d+)"\}')


class Launches(NamedTuple):
    """programs run, operations they launch, host arrays among their arguments."""

    programs: int
    operations: int
    arrays: int


@contextmanager
def counting():
    """Inside, `launches_of` counts. What was compiled before is traced again, once here and once
    afterwards: calls of known programs do not pass through Python.
    """
    run, fast = pxla.ExecuteReplicated.__call__, pjit._get_fastpath_data

    def counted(self, *args):
        host = sum(not isinstance(x, jax.Array) for x in args)
        _SEEN.append((_operations(self.xla_executable), host))
        return run(self, *args)

    jax.clear_caches()
    pxla.ExecuteReplicated.__call__ = counted
    pjit._get_fastpath_data = lambda *_, **__: None
    try:
        yield
    finally:
        pxla.ExecuteReplicated.__call__ = run
        pjit._get_fastpath_data = fast
        jax.clear_caches()


def launches_of(call) -> Launches:
    """Those of `call()`, which is called once before, so that everything is compiled."""
    call()
    _SEEN.clear()
    call()
    return Launches(len(_SEEN), sum(n for n, _ in _SEEN), sum(host for _, host in _SEEN))


_SEEN: list[tuple[int, int]] = []


@lru_cache(maxsize=512)
def _operations(executable) -> int:
    return operations_in(executable.hlo_modules()[0].to_string())


def operations_in(text: str) -> int:
    """Operations that a compiled program launches, from its text."""
    computations, entry, name = {}, None, None
    for line in text.splitlines():
        begins = _COMPUTATION.match(line)
        if begins:
            name = begins.group(2)
            computations[name] = []
            entry = name if begins.group(1) else entry
        elif name and _INSTRUCTION.match(line):
            computations[name].append(line)
    return _count(computations, entry)


def _count(computations: dict[str, list[str]], name: str) -> int:
    total = 0
    for line in computations[name]:
        kind = _INSTRUCTION.match(line).group(1)
        if kind == "while":
            trips = int((_TRIPS.search(line) or [0, 1])[1])
            inner = [_named(line, part) for part in ("condition", "body")]
            total += trips * sum(_count(computations, part) for part in inner)
        elif kind == "conditional":
            total += 1 + max(_count(computations, part) for part in _branches(line))
        elif kind == "call":
            total += _count(computations, _named(line, "to_apply"))
        elif kind not in FREE:
            total += 1
    return total


def _named(line: str, part: str) -> str:
    return re.search(rf"{part}=%?([\w.-]+)", line).group(1)


def _branches(line: str) -> list[str]:
    many = re.search(r"branch_computations=\{([^}]*)\}", line)
    if many:
        return [x.strip().lstrip("%") for x in many.group(1).split(",")]
    return [_named(line, part) for part in ("true_computation", "false_computation")]
