"""Digests of objects by content: code, numbers, and everything that these refer to.

A compiled program and a folder of finished runs belong to one system. Both are given up when any of
this has changed, though name and law are the same. Loads NumPy alone, for worker processes.
"""

import contextlib
import dis
import gc
import hashlib
import sys
import types
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from fractions import Fraction
from functools import cached_property, lru_cache, partial
from importlib import import_module
from importlib.util import find_spec, resolve_name
from itertools import accumulate, chain
from typing import NamedTuple

import numpy as np

from parc_jax.checker.rests_on import printable
from parc_jax.learning.systems.user_code import is_own

# speed and labels, which change no number
OPERATIONAL = ("workers", "threads", "chunk", "at_once", "p_labels", "q_labels", "k_labels")
_MOST = 20_000  # objects read before each chunk of runs; those beyond count as opaque
_PLAIN = (bool, int, float, complex, str, bytes, type(None), type(Ellipsis))
_BASES = (*_PLAIN, Mapping, set, frozenset, list, tuple, np.ndarray)  # of values of users' classes
TABLE, _SHOWN = (*_PLAIN, np.ndarray), (types.GetSetDescriptorType, types.MemberDescriptorType)
_LONG, _BEGINS = 200, 60  # characters of a text that is told whole; of others, how many
_MAIN = ("__main__", "__mp_main__")  # names of the main module, the second in spawned processes
_GLOBAL = ("LOAD_GLOBAL", "LOAD_NAME", "LOAD_ASSERTION_ERROR")
_WRITTEN = ("__repr__", "__annotate__", "__annotate_func__", "_value2member_map_")  # no numbers
# of libraries, what is private decides no number, or is filled by each run
SERVING = ("logging.", "threading.", "concurrent.", "multiprocessing.", "asyncio.")
_RUNNING = ("parc_jax.", "mujoco._structs.MjData", *SERVING)
_MAKING = ("__init__", "__post_init__", "__new__")
_OF_TUPLES = ("__new__", "__getnewargs__", "_make", "_replace", "_asdict")  # with named items


class Content(NamedTuple):
    """Digest of a system at a moment of a process. held: its parts, alive so that no id recurs."""

    digest: str
    held: list


def content_of(system) -> Content:
    """Code and data that the system reaches: attributes (nested), closures, defaults, and the
    globals that its own functions name. Opaque objects are told apart by identity alone.
    """
    reader = Reader(lasting=False)
    return Content(reader.digest(system), reader.held)


def told_whole(x) -> str:
    """A text that no other content has: of what `str` may shorten, a beginning and a digest."""
    text = str(x)
    whole = _is_exact(x) and len(text) <= _LONG and text.isprintable()
    return text if whole else with_digest(text, [x, text])


def with_digest(text: str, x) -> str:
    """The beginning of a text, and a digest of all content of x."""
    begins = printable(" ".join(text.split())[:_BEGINS])
    return f"{begins}, content {whole_digest(x)[:12]}"


def whole_digest(x) -> str:
    """Of all code and data that an object reaches, private ones too, the same in any process."""
    return Reader(lasting=True, private=True).digest(x)


class Reader:
    """Digests of objects by content. lasting: the digest is the same in another process. private:
    such a one, of all attributes, and of opaque objects as they are copied. named: by name, those
    of parts first.
    """

    def __init__(self, lasting: bool, private: bool = False):
        self.lasting, self.private = lasting, private
        self.held: list = []
        self.named: dict[str, str] = {}
        self._cached: dict[object, str] = {}

    def digest(self, x) -> str:
        """Equal content, equal digest."""
        if type(x) in _PLAIN or (isinstance(x, _PLAIN) and not is_own(file_of(type(x)))):
            return f"{type(x).__name__} {x!r}"
        return self._once(id(x), x, lambda: self._parts(x))

    def digest_of_type(self, x) -> str:
        """Of the type of an instance, but for what made this: that is read from it."""
        cls = type(x)
        return self._once((id(cls), "of one"), cls, lambda: self._class(cls, besides=_MAKING))

    def attributes(self, x) -> Iterator[tuple[str, object]]:
        """Attributes of an instance that decide its numbers."""
        names = dict.fromkeys(f.name for f in fields(x)) if is_dataclass(x) else {}
        names |= dict.fromkeys(getattr(x, "__dict__", {}))
        for cls in type(x).__mro__:
            if "__slots__" in vars(cls):  # by their members: `__x` has another name there
                names |= {y: 0 for y, d in vars(cls).items() if isinstance(d, _SHOWN[1])}
        for name in names:
            if hasattr(x, name) and not (self.lasting and self._hidden(x, name)):
                table = name.removeprefix("_")  # SciPy completes some as they are asked for
                asked = isinstance(getattr(type(x), table, None), property)
                asked &= self.lasting and name_of(type(x)).startswith("scipy.")
                yield name, getattr(x, table if asked else name)

    def _hidden(self, x, name: str) -> bool:
        # made from the others, once they are asked for, by `once` and here; or said to pass
        passing = ("_made", *getattr(type(x), "__passing__", ()))
        works = name == "_data" and hasattr(x, "_eval_args")  # memory of FITPACK, never the same
        if works or name in passing or isinstance(getattr(type(x), name, None), cached_property):
            return True
        if self._is_whole(x, name):  # values of libraries have caches, and tell all in `repr`
            return name.startswith("_") and _is_value(x)
        return name.startswith("_") or name in OPERATIONAL

    def _is_whole(self, x, name: str = "") -> bool:
        """Whether private parts of that name count: a library's are named by none of the user's."""
        runs = name_of(type(x)).startswith(_RUNNING) or x is np.random.rand.__self__
        derived = name not in getattr(x, "__dataclass_fields__", (name,))
        return self.private or not (runs or derived or is_own(file_of(type(x))))

    def _once(self, key, x, parts) -> str:
        if key in self._cached:
            return self._cached[key]
        self.held.append(x)
        has_name = isinstance(x, types.FunctionType | type)  # these are always read
        if len(self.held) > _MOST and not has_name and not self.lasting:
            return self._opaque(x)
        self._cached[key] = "itself"  # a cycle
        digest = hashlib.blake2b(digest_size=16)
        for part in parts():
            digest.update(part if isinstance(part, bytes) else str(part).encode())
            digest.update(b"\0")
        told = self._cached[key] = digest.hexdigest()
        if has_name:
            self.named[name_of(x)] = told
        return told

    def _opaque(self, x) -> str:
        if not self.lasting:
            return f"{name_of(type(x))} {id(x)}"
        if not self._is_whole(x):
            return name_of(type(x))
        # copies of compiled classes may hold addresses: tables that they show tell more
        shown = {y: d for cls in reversed(type(x).__mro__) for y, d in vars(cls).items()}
        shown = [y for y, d in shown.items() if isinstance(d, _SHOWN) and not y.startswith("_")]
        tables = [y for y in (getattr(x, y, None) for y in shown) if isinstance(y, TABLE)]
        known = any(isinstance(y, np.ndarray) for y in tables)
        return name_of(type(x)) + self.digest(tables if known else _copied(x))

    def _parts(self, x) -> Iterator:
        yield type(x).__qualname__
        if isinstance(x, _BASES) and is_own(file_of(type(x))):  # has methods beside its items
            yield self.digest_of_type(x)
            yield from (self.digest(part) for part in self.attributes(x))
        jax = sys.modules.get("jax")  # an object of JAX was made by it
        if jax is not None and isinstance(x, jax.core.Tracer):
            yield self._opaque(x)
        elif jax is not None and isinstance(x, jax.Array) and not self.lasting:
            yield id(x)  # cannot change
        elif jax is not None and isinstance(x, jax.Array):
            is_key = jax.dtypes.issubdtype(x.dtype, jax.dtypes.prng_key)
            yield from self._array(np.asarray(jax.random.key_data(x) if is_key else x))
        elif isinstance(x, np.ndarray | np.generic):
            for part in (np.asarray(x), *[np.ma.getmaskarray(x)] * np.ma.isMA(x)):
                yield from self._array(part)
        elif isinstance(x, Mapping):
            yield from (self.digest(part) for pair in list(x.items()) for part in pair)
        elif isinstance(x, set | frozenset):
            yield from sorted(map(self._alone, x))
        elif isinstance(x, list | tuple):
            yield from (self.digest(item) for item in list(x))
        elif isinstance(x, _PLAIN):
            yield next(base for base in _PLAIN if isinstance(x, base)).__repr__(x)
        else:
            yield from self._code(x)

    def _alone(self, x) -> str:
        """As if it were read first: items of a set come in any order, and may reach each other."""
        known, self._cached = self._cached, dict(self._cached)
        digest, self._cached = self.digest(x), known
        return digest

    def _array(self, x: np.ndarray) -> Iterator:
        yield x.shape
        if x.dtype.hasobject:
            yield from (self.digest(item) for item in x.ravel().tolist())
        else:
            yield x.dtype.str
            yield np.ascontiguousarray(x).tobytes()

    def _code(self, x) -> Iterator:
        """Functions, methods, classes, modules, by the user's code; others by their attributes."""
        if isinstance(x, types.FunctionType):
            yield from self._function(x)
        elif isinstance(x, types.CodeType):
            yield x.co_code
            if x.co_exceptiontable:
                yield x.co_exceptiontable
            yield x.co_names + x.co_varnames + x.co_freevars
            yield from (self.digest(constant) for constant in x.co_consts)
        elif isinstance(x, types.MethodType):
            yield from map(self.digest, (x.__func__, x.__self__))
        elif isinstance(x, partial):
            yield from (self.digest(part) for part in (x.func, x.args, x.keywords))
        elif isinstance(x, property | cached_property):
            yield self.digest(x.fget if isinstance(x, property) else x.func)
        elif isinstance(x, type):
            yield from self._class(x)
        elif isinstance(x, types.BuiltinFunctionType | types.MethodWrapperType):
            yield x.__name__
            if not isinstance(x.__self__, types.ModuleType | None):  # `table.get`
                yield self.digest(x.__self__)
        elif isinstance(x, types.ModuleType | np.ufunc):
            yield (name := getattr(x, "__name__", ""))
            if isinstance(x, np.ufunc):  # the function in one of `np.frompyfunc`
                yield from map(self.digest, filter(callable, gc.get_referents(x)))
            elif name.startswith("jax"):
                self.named["jax_enable_x64"] = str(sys.modules["jax"].config.jax_enable_x64)
        else:
            yield from self._object(x)

    def _object(self, x) -> Iterator:
        if (inner := getattr(x, "__wrapped__", None)) is not None:  # jitted and cached functions
            yield self.digest(inner)
            if not is_own(file_of(type(x))):
                return
        if told := _is_value(x) and repr(x):  # first: some keep what they told
            yield self.digest(_copied(x) or told)  # which may have addresses, and not all
        if name_of(type(type(x))).startswith("_ctypes."):
            kinds = "".join(memoryview(x).format.split(":")[::2])  # without names of fields
            yield bytes(x) * {*"zZPO&X"}.isdisjoint(kinds)  # no addresses
        named = list(self.attributes(x))
        if not told and not named and not is_dataclass(x) and not is_own(file_of(type(x))):
            yield self._opaque(x)
            return
        yield self.digest_of_type(x)
        for name, value in named:
            yield from (name, self.digest(value))

    def _class(self, cls: type, besides: tuple[str, ...] = ()) -> Iterator:
        yield name_of(cls)
        if is_own(file_of(type(cls))):
            yield self.digest(type(cls))
        for base in (base for base in cls.__mro__ if is_own(file_of(base))):
            # by name: a class that was sent by value has them in another order
            for name, value in sorted(vars(base).items()):
                if name in _WRITTEN + besides or (name in _OF_TUPLES and "_fields" in vars(base)):
                    continue
                method = callable(value) or hasattr(value, "__get__")
                if (name.startswith("__") and not method) or isinstance(value, _SHOWN):
                    continue  # told by Python: text, lines, annotations; slots: of the instance
                yield name
                yield self.digest(value)

    def _function(self, f: types.FunctionType) -> Iterator:
        code = f.__code__
        yield name_of(f)
        for cell in f.__closure__ or ():
            yield "empty" if cell == types.CellType() else self.digest(cell.cell_contents)
        yield from map(self.digest, (f.__defaults__, f.__kwdefaults__))
        if not is_own(code.co_filename):
            yield self.digest(getattr(f, "__wrapped__", None))
            return
        yield self.digest(code)
        space, names = f.__globals__, frozenset(_names(code))
        meant = {x: space[x] for x in named_in(code) if x in space and not x.startswith("@")}
        yield from self._named(meant, names, space.get("__name__", ""))
        taken = _imports(code, space.get("__package__") or "")
        # all of them before any is read
        modules = {name: own for name in taken if (own := _own_module(name)) is not None}
        yield from self._named(modules, names.union(modules), "sys.modules")
        for name, value in self.attributes(f):
            yield from (name, self.digest(value))

    def _named(self, space: dict, names: frozenset, of: str) -> Iterator:
        """Values of the names of a function in its module."""
        for name in sorted(names & space.keys()):
            value = space[name]
            yield name
            if isinstance(value, types.ModuleType) and is_own(getattr(value, "__file__", "") or ""):
                # of a module of the user's the named values alone: `params.GUST`
                inner = partial(self._named, vars(value), names, value.__name__)
                yield self._once((id(value), names), value, inner)
            else:
                told = self.named[f"{_MAIN[0] if of in _MAIN else of}.{name}"] = self.digest(value)
                yield told


def _is_exact(x) -> bool:
    """Whether `str` tells all of it: that of a class of the user's may tell anything."""
    if is_own(file_of(type(x))):
        return False
    if isinstance(x, Mapping):
        return all(_is_exact(part) for pair in x.items() for part in pair)
    if isinstance(x, list | tuple | set | frozenset):
        return all(map(_is_exact, x))
    return isinstance(x, (*_PLAIN, np.integer, np.bool_, Fraction))


def _is_value(x) -> bool:
    """Whether a library compares its class by value, as Fraction, Path and members of Enum are."""
    by = next(cls for cls in type(x).__mro__ if "__hash__" in vars(cls))
    told = not is_dataclass(x) and type(x).__repr__ is not object.__repr__
    weak = by.__module__ in ("weakref", "_weakrefset")  # tells an address
    return told and by is not object and not weak and not is_own(file_of(by))


def _copied(x) -> tuple:
    """What a copy of a value is made of; nothing where it cannot be copied."""
    try:
        _, *parts = x.__reduce_ex__(4)
    except Exception:  # hooks of an object may raise anything
        return ()
    return tuple(list(part) if isinstance(part, Iterator) else part for part in parts)


def _codes(code: types.CodeType) -> Iterator[types.CodeType]:
    """A function and the functions inside it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _codes(constant)


def _names(code: types.CodeType) -> Iterator[str]:
    """Global and attribute names, and texts: `getattr(params, "GUST")`."""
    for one in _codes(code):
        yield from one.co_names
        yield from (constant for constant in one.co_consts if isinstance(constant, str))


@lru_cache(maxsize=4096)  # a system is looked at before every chunk of its runs
def named_in(code: types.CodeType, by: tuple[str, ...] = _GLOBAL) -> tuple[str, ...]:
    """Names by their use; global ones are all that a function takes to another process."""
    steps = chain.from_iterable(map(dis.get_instructions, _codes(code)))
    return tuple(step.argval for step in steps if step.opname in by)


@lru_cache(maxsize=4096)
def _imports(code: types.CodeType, package: str) -> tuple[str, ...]:
    """What may be the name of a module, of all imports in a function of a package."""
    names = []
    for steps in map(dis.get_instructions, _codes(code)):
        steps = [step for step in steps if step.opname != "EXTENDED_ARG"]
        for i in (i for i, step in enumerate(steps) if step.opname == "IMPORT_NAME"):
            level, taken, name = (step.argval for step in steps[i - 2 : i + 1])
            with contextlib.suppress(ImportError):  # beyond the package
                name = resolve_name("." * level + name, package)
                names += [*accumulate(name.split("."), "{}.{}".format)]
                names += [f"{name}.{part}" for part in taken or ()]
    return tuple(dict.fromkeys(names))


def _own_module(name: str) -> types.ModuleType | None:
    """The user's module of that name, loaded as a run would load it; None for any other."""
    root = name.partition(".")[0]
    try:
        if name not in sys.modules:
            spec = find_spec(root)
            # a folder without __init__ has no origin
            if spec and (spec.origin is None or (spec.has_location and is_own(spec.origin))):
                import_module(name)
        module = sys.modules.get(name)
    except KeyboardInterrupt:
        raise
    except BaseException:  # it is no module, or exits, or skips, or raises anything: a run tells
        return None
    own = module is not None and is_own(getattr(module, "__file__", None) or "")
    return module if own and root not in sys.builtin_module_names else None


def name_of(x) -> str:
    """Module and name of a class or function, the same in every process that it is sent to."""
    return f"{_MAIN[0] if x.__module__ in _MAIN else x.__module__}.{x.__qualname__}"


def file_of(cls: type) -> str:
    """The file of a class; library files for built-in ones."""
    module = sys.modules.get(cls.__module__)
    if module is None and any(isinstance(x, types.FunctionType) for x in vars(cls).values()):
        return "<own>"  # sent here by value
    if cls.__module__ in sys.builtin_module_names or module is None:
        return "<frozen>"
    sent = cls.__module__ in _MAIN  # of another process, perhaps
    return (not sent and getattr(module, "__file__", None)) or "<own>"
