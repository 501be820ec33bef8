"""Array doors: everything that ends in a verdict is float64, under any global JAX flag of the user;
compiled calls over many rows, on all cores.
"""

import hashlib
import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike

from parc_jax.common.errors import InputError, shown

NO_NUMBER = TypeError, ValueError, OverflowError  # of what becomes no float64
HIGHEST = jax.lax.Precision.HIGHEST  # accelerators round inputs of products to fewer bits otherwise
product = partial(jnp.matmul, precision=HIGHEST)


def x64():
    """Context in which JAX computes in float64, for verdict kernels; no global flag is touched."""
    return jax.enable_x64(True)


def as_float64(name: str, value, shape: tuple[int | None, ...]) -> np.ndarray:
    """A finite, read-only float64 copy of this shape (None: any length). Raises InputError."""
    wanted = str(shape).replace("None", "any")
    try:
        array = np.array(real(value), dtype=np.float64)
    except NO_NUMBER as error:
        raise InputError(
            f"{name}: expected numbers of shape {wanted}; got {shown(value, 80)} ({error})."
        ) from None
    fits = array.ndim == len(shape) and all(
        want in (None, have) for want, have in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise InputError(f"{name}: expected shape {wanted}; got {array.shape}.")
    if not np.isfinite(array).all():
        bad = int(np.size(array) - np.isfinite(array).sum())
        raise InputError(
            f"{name}: expected finite numbers; got {bad} NaN or infinite entries. Clean the data."
        )
    array.setflags(write=False)
    return array


def read_only(array: np.ndarray) -> np.ndarray:
    """A view that nobody writes through."""
    view = array.view()
    view.setflags(write=False)
    return view


def restored(record, state: dict) -> None:
    """`__setstate__` of a frozen record: copies and pickles lose the flags of arrays, and what was
    made of them once is of no others.
    """

    def kept(value):
        if type(value) is tuple:
            return tuple(map(kept, value))
        return read_only(value) if isinstance(value, np.ndarray) else value

    vars(record).update({name: kept(x) for name, x in state.items() if name[0] != "_"})


class Sealed:
    """A frozen record whose arrays nobody writes over, also in its copies and pickles."""

    def __post_init__(self) -> None:
        restored(self, vars(self))

    __setstate__ = restored


def at_least(name: str, value, lowest: float = 0.0) -> float:
    """A finite number that is no less than the lowest. Raises InputError."""
    number = float(as_float64(name, value, ()))
    if not number >= lowest:
        raise InputError(f"{name}: expected a number >= {lowest:g}; got {value!s:.40}.")
    return number


def real(value):
    """The value itself. Raises TypeError for True and False, for times, for complex numbers, of
    which NumPy would drop half, and for masked ones, whose mask it would drop.
    """
    listed = isinstance(value, bool | list | tuple)
    kind = getattr(getattr(np.asarray(value) if listed else value, "dtype", None), "kind", "")
    if kind in ("b", "c", "m", "M"):
        raise TypeError("complex numbers" if kind == "c" else "True, False and times are none")
    if np.ma.is_masked(value):
        raise TypeError("masked numbers")
    return value


def slices(n: int, size: int) -> Iterator[slice]:
    """The rows 0..n-1 in chunks of at most `size`, in order."""
    return (slice(first, min(first + size, n)) for first in range(0, n, size))


def on_all_cores(call: Callable, parts: Iterable) -> list:
    """[call(part), ...] on one thread per core: compiled calls and large NumPy operations let other
    threads run. Not for use inside of a call: its threads would wait for each other.
    """
    parts = list(parts)
    if len(parts) < 2:  # a thread costs more than a first look
        return [call(part) for part in parts]
    return list(_threads(os.getpid()).map(call, parts))


@cache
def _threads(process: int) -> ThreadPoolExecutor:
    """The threads of a process; a forked child has none of its parent's."""
    return ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix="parc_jax")


def in_chunks(n: int, size: int, call: Callable):
    """The results of call(rows) for all rows 0 ... n - 1, on all cores. The one way to run a
    compiled call over many rows.

    rows: (size,) int, always as many, so that one program is compiled; the last chunk is filled up
    by repeating its last row. call returns arrays, or a tuple of them, with leading axis `size`;
    they are put together and cut to n rows. See `map_rows` for arrays. Raises InputError.
    """
    if n < 1:
        raise InputError("runs: expected at least one; got none.")
    rows = np.minimum(np.arange(-(-n // size) * size), n - 1).reshape(-1, size)
    return jax.tree.map(lambda *x: np.concatenate(x)[:n], *on_all_cores(call, rows))


def map_rows(size: int, kernel: Callable, *batch, only: Callable | None = None):
    """A compiled, vectorised kernel over n >= 0 rows of arrays (n, ...), `size` a call, in float64.

    only: of the results of a call, (size,) bool the rows to return; others are never put together.
    """
    n = len(batch[0])
    if n == 0:
        batch = [np.zeros((1, *np.shape(x)[1:]), np.asarray(x).dtype) for x in batch]

    def one(rows):
        with x64():
            out = jax.device_get(kernel(*(np.asarray(x)[rows] for x in batch)))
        if only is None:
            return out
        chosen = only(out) & (np.diff(rows, prepend=-1) > 0)  # the last row is repeated to fill up
        return jax.tree.map(lambda x: x[chosen], out)

    return jax.tree.map(lambda x: x[:n], in_chunks(max(n, 1), size, one))


def dot(a, b):
    """Product of a and b (..., n) over the last axis, written out so that it fuses and never
    becomes a matmul of reduced precision. Kernel; n is small.
    """
    products = a * b
    return sum(products[..., i] for i in range(1, products.shape[-1])) + products[..., 0]


def least(x: np.ndarray | jax.Array, axis: int | tuple[int, ...] | None = None):
    """Least along axes, -inf where one is undefined. Kernel, NumPy or JAX."""
    # some versions of JAX lose NaN in a minimum, and an undefined number must not look like room
    xp = jnp if isinstance(x, jax.Array) else np
    return xp.where(xp.isnan(x), -np.inf, x).min(axis=axis)


def most(x: np.ndarray | jax.Array, axis: int | tuple[int, ...] | None = None):
    """Largest along axes, inf where one is undefined. Kernel, NumPy or JAX."""
    xp = jnp if isinstance(x, jax.Array) else np
    return xp.where(xp.isnan(x), np.inf, x).max(axis=axis)


def least_over(A: jax.Array, lo: jax.Array, hi: jax.Array):
    """Least value (n, h) of each row of A (h, m) over the boxes lo, hi (n, m). Kernel."""
    return jnp.minimum(A[None] * lo[:, None], A[None] * hi[:, None]).sum(axis=2)


def single(x: ArrayLike) -> jax.Array:
    """Floats as float32, all else as it is: for proposals, which decide nothing. Kernel."""
    x = jnp.asarray(x)
    return x.astype(jnp.float32) if jnp.issubdtype(x.dtype, jnp.floating) else x


def once(owner, make: Callable, *about):
    """make(owner, *about), about hashable, made once while `owner`, a frozen record, lives."""
    made = owner.__dict__.setdefault("_made", {})
    name = (make, *about)
    if name not in made:
        made[name] = make(owner, *about)
    return made[name]


def content_hash(*arrays) -> str:
    """SHA-256 over shapes and float64 bytes: equal content, equal hash, on every machine."""
    digest = hashlib.sha256()
    for array in arrays:
        array = np.ascontiguousarray(np.asarray(array), dtype="<f8")
        digest.update(repr(array.shape).encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def difference(a, b) -> np.ndarray:
    """|a - b|: none where both are NaN, infinite where one of them is."""
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    both = np.isnan(a) & np.isnan(b)
    gap = np.abs(np.where(both, 0.0, a) - np.where(both, 0.0, b))
    return np.where(np.isnan(gap), np.inf, gap)
