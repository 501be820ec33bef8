"""Digests of what own worker processes may hold otherwise: they import the user's modules anew."""

import contextlib
import gc
import marshal
import os
import types
from collections.abc import Iterator
from functools import partial

from parc_jax.learning.systems import content
from parc_jax.learning.systems.user_code import is_own

_TABLES = (dict, list, tuple, set, frozenset, types.MappingProxyType)
_HOLDING = (*_TABLES, types.FunctionType, types.CellType, types.MethodType, partial)
# new in each process; of pointers the type of their type
_BY_TYPE = (*content.SERVING, "subprocess.", "socket.", "ctypes.CDLL", "_ctypes.PyCPointer")


class OwnWorkers(content.Reader):
    """Counts private attributes of the user's objects too, of wrappers the user's code alone."""

    def _is_whole(self, x, name: str = "") -> bool:
        private = name.startswith("_") and is_own(content.file_of(type(x)))
        return private or super()._is_whole(x, name)

    def _parts(self, x) -> Iterator:
        if type(x) in _TABLES:
            with contextlib.suppress(Exception):  # of what cannot be written, or compared
                told = marshal.dumps(x, 2)  # fast; from 3 on it tells which are one object
                if marshal.loads(told) == x:  # no array: of one it writes bytes, or addresses
                    yield told
                    return
        yield from super()._parts(x)

    def _code(self, x) -> Iterator:
        asserts = isinstance(x, types.CodeType) and {None, "@pytest_ar"} & {*content.named_in(x)}
        if asserts and "PYTEST_CURRENT_TEST" in os.environ:  # it wrote code for assert (None) anew
            yield x.co_firstlineno
        elif not any(content.name_of(y).startswith(_BY_TYPE) for y in (type(x), type(type(x)))):
            yield from super()._code(x)

    def _function(self, f: types.FunctionType) -> Iterator:
        wraps = hasattr(f, "__wrapped__") and not is_own(f.__code__.co_filename)
        yield from self._users(f, set()) if wraps else super()._function(f)

    def _users(self, x, seen: set[int], fixed: bool = True) -> Iterator[str]:
        """Of a library's wrapper the user's code, and what is in no table: these runs may fill."""
        function = isinstance(x, types.FunctionType)
        kind = x if isinstance(x, type) else type(x)
        own = is_own(x.__code__.co_filename if function else content.file_of(kind))
        if own or (isinstance(x, content.TABLE) and "0x" not in str(x)):  # an address
            yield from [self.digest(x)] * (fixed or callable(x))
        elif isinstance(x, _HOLDING) and id(x) not in seen:
            seen.add(id(x))
            parts = gc.get_referents(x)
            if function:
                yield self.digest(getattr(x, "__wrapped__", None))
                filled = content.named_in(x.__code__, ("STORE_DEREF",))
                cells = zip(x.__code__.co_freevars, x.__closure__ or (), strict=True)
                parts = [cell for name, cell in cells if name not in filled]
                parts += [x.__defaults__, x.__kwdefaults__, vars(x)]
            for part in parts:
                yield from self._users(part, seen, fixed and not isinstance(x, dict | list | set))
