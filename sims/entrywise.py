"""A program over small arrays, run entry by entry: the same numbers from fewer operations.

A rigid body of three joints is matrices of a few entries, most of them known beforehand to be zero
or one. Batched, each operation on them is a loop of its own over short rows; entry by entry, an
entry is one array over all runs, products with zero and one vanish while the program is traced, and
what is left is fused. Only what rounding does to sums of products may differ.
"""

import math
import operator
import warnings
from collections.abc import Callable
from functools import reduce

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import Literal


class _NotByEntries(Exception):
    """A step that is only known for whole arrays."""


def entrywise(fun: Callable) -> Callable:
    """fun, of vectors, as a function of their entries: it takes a sequence of numbers or JAX arrays
    of one shape for each vector, and returns such a list for each. Jit it: it is traced anew at
    every call. NaN and infinities times a known zero are zero. A program with loops over unknown
    numbers, or with other steps that are not listed here, is run as it is, over all runs at once,
    and a warning says so.
    """

    def run(*vectors):
        like = [jax.ShapeDtypeStruct((len(each),), jnp.result_type(*each)) for each in vectors]
        program = jax.make_jaxpr(fun)(*like)
        try:
            found = _run(program.jaxpr, program.consts, [_objects(each) for each in vectors])
        except _NotByEntries as no:
            warnings.warn(f"entrywise: {no}; the program is run as it is, slower.", stacklevel=2)
            found = _as_it_is(fun, vectors)
        return [list(each) for each in found]

    return run


def _as_it_is(fun: Callable, vectors) -> list[jax.Array]:
    """The same results, (entries, ...) each, by fun itself over all runs."""
    shape = jnp.broadcast_shapes(*(jnp.shape(x) for each in vectors for x in each))
    whole = lambda *each: jax.tree.leaves(fun(*each))  # noqa: E731
    for _ in shape:
        whole = jax.vmap(whole)
    stacked = [jnp.stack([jnp.broadcast_to(x, shape) for x in each], axis=-1) for each in vectors]
    return [jnp.moveaxis(each, -1, 0) for each in whole(*stacked)]


def _objects(entries) -> np.ndarray:
    """An array whose entries are these, arrays though they may be."""
    found = np.empty(len(entries), object)
    for place, entry in enumerate(entries):
        found[place] = entry
    return found


def _run(program, consts, entries) -> list[np.ndarray]:
    """The results of a jaxpr. Arrays are NumPy's: of numbers, or of objects where an entry is not
    known.
    """
    values = dict(zip(program.constvars, map(np.asarray, consts), strict=True))
    values |= zip(program.invars, entries, strict=True)

    def read(x):
        return np.asarray(x.val) if isinstance(x, Literal) else values[x]

    for step in program.eqns:
        name = step.primitive.name
        arrays = list(map(read, step.invars))
        if name == "jit":
            inner = step.params["jaxpr"]
            found = _run(inner.jaxpr, inner.consts, arrays)
        elif name == "device_put":
            found = arrays
        elif name not in _STEPS and all(a.dtype != object for a in arrays):
            with jax.ensure_compile_time_eval():
                found = step.primitive.bind(*arrays, **step.params)
                found = found if step.primitive.multiple_results else [found]
        elif name not in _STEPS:
            raise _NotByEntries(f"{name!r} is no step of single entries")
        else:
            found = [_STEPS[name](step.outvars[0].aval, *arrays, **step.params)]
        for var, value in zip(step.outvars, found, strict=True):
            values[var] = _known(value, var.aval)
    return [np.asarray(read(x)) for x in program.outvars]


def _known(value, aval) -> np.ndarray:
    """An array of numbers where every entry is one."""
    value = np.asarray(value)
    if value.dtype == object and any(_unknown(x) for x in value.flat):
        return value.reshape(aval.shape)
    return value.astype(aval.dtype).reshape(aval.shape)


def _unknown(x) -> bool:
    return isinstance(x, jax.Array)


def _is(x, number: float) -> bool:
    return not _unknown(x) and x == number


def _times(x, y):
    if _is(x, 0) or _is(y, 0):
        return 0.0
    if _is(x, 1) or _is(y, 1):
        return y if _is(x, 1) else x
    return x * y


def _plus(x, y):
    if _is(x, 0) or _is(y, 0):
        return y if _is(x, 0) else x
    return x + y


def _minus(x, y):
    return x if _is(y, 0) else x - y


def _over(x, y):
    return x if _is(y, 1) or _is(x, 0) else x / y


def _either(which, *cases):
    return jnp.where(which, cases[1], cases[0]) if _unknown(which) else cases[int(which)]


def _each(one: Callable, many: Callable) -> Callable:
    """A step on entries: `one` for each where some are unknown, NumPy's `many` for numbers."""

    def step(out, *arrays, **_):
        if all(a.dtype != object for a in arrays):
            return many(*arrays)
        found = np.empty(np.broadcast_shapes(*(a.shape for a in arrays)), object)
        return np.frompyfunc(one, len(arrays), 1)(*arrays, out=found)

    return step


def _of_one(name: str) -> Callable:
    return _each(getattr(jnp, name), getattr(np, name))


def _sum(a: np.ndarray, axis: int) -> np.ndarray:
    add = np.frompyfunc(_plus, 2, 1) if a.dtype == object else np.add
    return add.reduce(a, axis=axis, keepdims=True)


def _dot(out, a, b, dimension_numbers, **_):
    """Batch axes first, then those of a, then those of b that are left."""
    (along_a, along_b), (batch_a, batch_b) = dimension_numbers
    left_a = [i for i in range(a.ndim) if i not in (*along_a, *batch_a)]
    left_b = [i for i in range(b.ndim) if i not in (*along_b, *batch_b)]
    n, m, own, other = (
        math.prod(array.shape[i] for i in axes)
        for array, axes in ((a, batch_a), (a, along_a), (a, left_a), (b, left_b))
    )
    a = a.transpose(*batch_a, *left_a, *along_a).reshape(n, own, 1, m)
    b = b.transpose(*batch_b, *left_b, *along_b).reshape(n, 1, other, m)
    return _sum(_STEPS["mul"](out, a, b), -1)


def _broadcast(out, a, shape, broadcast_dimensions, **_):
    at = iter(a.shape)
    kept = [next(at) if i in broadcast_dimensions else 1 for i in range(len(shape))]
    return np.broadcast_to(a.reshape(kept), shape)


def _slice(out, a, start_indices, limit_indices, strides, **_):
    steps = strides or (1,) * a.ndim
    return a[tuple(map(slice, start_indices, limit_indices, steps))]


def _converted(out, a, **_):
    one = lambda x: x.astype(out.dtype) if _unknown(x) else out.dtype.type(x)  # noqa: E731
    return _each(one, np.asarray)(out, a)


def _windows(of, index, sizes: dict[int, int], map_to, batching, batching_index):
    """Yield (place in the index, place in the window, place in the array `of`) of every entry.
    sizes: of the window, along the axes that it has. Windows beyond the array are left out.
    """
    for where in np.ndindex(index.shape[:-1]):
        start = dict(zip(map_to, map(int, index[where]), strict=True))
        start |= {axis: where[own] for axis, own in zip(batching, batching_index, strict=True)}
        begin = [start.get(axis, 0) for axis in range(of.ndim)]
        ends = [at + sizes.get(axis, 1) for axis, at in enumerate(begin)]
        if min(begin, default=0) < 0 or any(map(operator.gt, ends, of.shape)):
            continue
        for inside in np.ndindex(*sizes.values()):
            step = dict(zip(sizes, inside, strict=True))
            yield where, inside, tuple(at + step.get(axis, 0) for axis, at in enumerate(begin))


def _woven(where, inside, offsets, ndim: int) -> tuple[int, ...]:
    """The place in an array whose axes `offsets` are those of the window."""
    outer, inner = iter(where), iter(inside)
    return tuple(next(inner if axis in offsets else outer) for axis in range(ndim))


def _gather(out, a, index, dimension_numbers, slice_sizes, **_):
    how = dimension_numbers
    gone = (*how.collapsed_slice_dims, *how.operand_batching_dims)
    sizes = {axis: size for axis, size in enumerate(slice_sizes) if axis not in gone}
    batching = how.operand_batching_dims, how.start_indices_batching_dims
    found = np.full(out.shape, None, object)
    for where, inside, place in _windows(a, index, sizes, how.start_index_map, *batching):
        found[_woven(where, inside, how.offset_dims, found.ndim)] = a[place]
    if any(x is None for x in found.flat):
        raise _NotByEntries("an entry that there is not is looked up")
    return found


def _scatter(join: Callable) -> Callable:
    """Updates beyond the array are left out, as JAX does where nothing else is asked."""

    def step(out, a, index, updates, dimension_numbers, mode, **_):
        how = dimension_numbers
        if mode == jax.lax.GatherScatterMode.CLIP:
            raise _NotByEntries("updates are moved inside of their array")
        gone = (*how.inserted_window_dims, *how.operand_batching_dims)
        kept = [axis for axis in range(a.ndim) if axis not in gone]
        sizes = dict(zip(kept, (updates.shape[i] for i in how.update_window_dims), strict=True))
        batching = how.operand_batching_dims, how.scatter_indices_batching_dims
        to = how.scatter_dims_to_operand_dims
        found = a.astype(object)
        for where, inside, place in _windows(a, index, sizes, to, *batching):
            new = updates[_woven(where, inside, how.update_window_dims, updates.ndim)]
            found[place] = join(found[place], new)
        return found

    return step


_STEPS: dict[str, Callable] = {
    "add": _each(_plus, np.add),
    "sub": _each(_minus, np.subtract),
    "mul": _each(_times, np.multiply),
    "div": _each(_over, np.true_divide),
    "rem": _each(jnp.fmod, np.fmod),
    "neg": _each(operator.neg, np.negative),
    "max": _of_one("maximum"),
    "min": _of_one("minimum"),
    "and": _each(operator.and_, np.bitwise_and),
    "or": _each(operator.or_, np.bitwise_or),
    "not": _each(operator.invert, np.invert),
    "lt": _each(operator.lt, np.less),
    "le": _each(operator.le, np.less_equal),
    "gt": _each(operator.gt, np.greater),
    "ge": _each(operator.ge, np.greater_equal),
    "eq": _each(operator.eq, np.equal),
    "ne": _each(operator.ne, np.not_equal),
    "select_n": _each(_either, lambda which, *cases: np.choose(which.astype(int), cases)),
    "sin": _of_one("sin"),
    "cos": _of_one("cos"),
    "sqrt": _of_one("sqrt"),
    "sign": _of_one("sign"),
    "abs": _of_one("abs"),
    "dot_general": _dot,
    "reduce_sum": lambda out, a, axes, **_: reduce(_sum, axes, a),
    "broadcast_in_dim": _broadcast,
    "slice": _slice,
    "gather": _gather,
    "scatter": _scatter(lambda old, new: new),
    "scatter-add": _scatter(_plus),
    "transpose": lambda out, a, permutation: a.transpose(permutation),
    "concatenate": lambda out, *parts, dimension: np.concatenate(parts, dimension),
    "stack": lambda out, *parts, axis: np.stack(parts, axis),
    "tile": lambda out, a, reps: np.tile(a, reps),
    "iota": lambda out, dimension, **_: np.indices(out.shape)[dimension],
    "cumsum": lambda out, a, axis, **_: a.cumsum(axis),
    "convert_element_type": _converted,
    "copy": lambda out, a, **_: a,
    **{name: lambda out, a, **_: a.reshape(out.shape) for name in ("reshape", "squeeze")},
}
