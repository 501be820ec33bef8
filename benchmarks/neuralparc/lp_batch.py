"""Many tiny linear programs at once: the JAX kernel proposes, NumPy checks, the host solver decides
the rest.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.neuralparc.lp_interior import interior_point
from benchmarks.neuralparc.lp_program import LPStatus
from benchmarks.neuralparc.lp_solve import GAP, LP_MARGIN, solve
from parc_jax.common.arrays import as_float64, slices, x64
from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import (
    dual_bound,
    row_bounds,
    violation,
)
from parc_jax.common.tolerances import TOLERANCES

MAX_N = 10
_CHUNK = 1024  # most programs per compiled call: the working set stays in cache
# fewest; between the two, batches are padded to powers of two so that few shapes compile
_BUCKET = 64
_ROW_BUCKET = 8  # rows are padded to a multiple of this


def proves_empty(A, b, multipliers, lo, hi, margin: float):
    """Where multipliers prove {A x <= b, lo <= x <= hi} empty. [T12b], with c = 0: Farkas' witness.

    multipliers: (..., h), scaled so that the largest is one. margin: [row units] by which the proof
        must clear zero.
    """
    scale = np.max(
        np.where(np.isfinite(multipliers), multipliers, 0.0), axis=-1, keepdims=True, initial=0.0
    )
    y = multipliers / np.where(scale > 0, scale, 1.0)
    return dual_bound(np.zeros(A.shape[-1]), A, b, y, lo, hi) > margin


@dataclass(frozen=True)
class LPBatch:
    """Answers to B linear programs; fields as in LPResult with a leading batch axis.

    status: (B,) int, values of LPStatus. x: (B, n). multipliers: (B, h). lower, upper: (B,).
    n_host: how many of them the batched kernel left to the host solver.
    """

    status: np.ndarray
    x: np.ndarray
    multipliers: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    n_host: int


def solve_batch(c, A, b, lo=None, hi=None) -> LPBatch:
    """min c.x over {A x <= b, lo <= x <= hi} for B programs of n <= 10 variables and h rows.

    c: (B, n). A: (B, h, n), or (h, n) shared by all. b: (B, h) or (h,). lo, hi: (B, n) or (n,),
    finite, or None. Verdicts as in `solve`, by the same checks. Give bounds where you know them:
    they are what a proof without rational arithmetic needs. Raises InputError.
    """
    c, A, b, lo, hi = _broadcast(c, A, b, lo, hi)
    x, y = propose(c, *_with_bound_rows(A, b, lo, hi))
    return _decide(c, A, b, lo, hi, x, y[:, : A.shape[1]])


def _broadcast(c, A, b, lo, hi):
    c = as_float64("LP batch c", c, (None, None))
    batch, n = c.shape
    if n > MAX_N:
        raise InputError(
            f"solve_batch: expected at most {MAX_N} variables; got {n}. Use `solve` one by one."
        )
    A = as_float64("LP batch A", A, (None, n) if np.ndim(A) == 2 else (batch, None, n))
    h = A.shape[-2]
    b = as_float64("LP batch b", b, (h,) if np.ndim(b) == 1 else (batch, h))
    bounds = []
    for name, bound, missing in (("lo", lo, -np.inf), ("hi", hi, np.inf)):
        if bound is not None:
            shape = (n,) if np.ndim(bound) == 1 else (batch, n)
            bound = as_float64(f"LP batch {name}", bound, shape)
        bounds.append(np.broadcast_to(missing if bound is None else bound, (batch, n)))
    return c, np.broadcast_to(A, (batch, h, n)), np.broadcast_to(b, (batch, h)), *bounds


def _with_bound_rows(A, b, lo, hi):
    """Finite bounds as rows, so that the kernel sees them."""
    eye = np.broadcast_to(np.eye(A.shape[2]), (A.shape[0], A.shape[2], A.shape[2]))
    rows, offsets = [A], [b]
    for sign, bound in ((1, hi), (-1, lo)):
        if np.isfinite(bound).all():
            rows.append(sign * eye)
            offsets.append(sign * bound)
    return np.concatenate(rows, axis=1), np.concatenate(offsets, axis=1)


def propose(c, A, b):
    """Unchecked hints for c (B, n), A (B, h, n), b (B, h): points x (B, n) and multipliers y (B,
    h).

    y belongs to an optimum, or is a Farkas ray of size one. Nothing may rest on them without a
    check from `witness`.
    """
    batch, h, n = A.shape
    length = np.linalg.norm(A, axis=2)
    length = np.where(length > 0, length, 1.0)
    more = -h % _ROW_BUCKET
    A = np.pad(A / length[..., None], ((0, 0), (0, more), (0, 0)))
    b = np.pad(b / length, ((0, 0), (0, more)), constant_values=1.0)
    x = np.empty((batch, n))
    y = np.empty((batch, h + more))
    with x64():
        for part in slices(batch, _CHUNK):
            rows = np.arange(batch)[part]
            size = max(_BUCKET, 1 << (len(rows) - 1).bit_length())
            padded = np.pad(rows, (0, size - len(rows)), mode="edge")
            found = _kernel(jnp.asarray(c[padded]), jnp.asarray(A[padded]), jnp.asarray(b[padded]))
            x[part], y[part] = (np.asarray(array)[: len(rows)] for array in found)
    return x, y[:, :h] / length


@jax.jit
def _kernel(c, A, b):
    """c (B, n), A (B, h, n), b (B, h) -> x (B, n), y (B, h), divided by tau (optimum) or by the
    largest y (ray).
    """
    columns = jnp.transpose(A, (2, 1, 0))
    st = interior_point([*c.T], [*columns], b.T)
    solved = st.tau > st.kappa
    scale = jnp.where(solved, st.tau, st.y.max(0))
    return (jnp.stack(st.x) / st.tau[None]).T, (st.y / scale[None]).T


def _decide(c, A, b, lo, hi, x, y) -> LPBatch:
    """Statuses from witnesses; programs without one go to the host."""
    low, high = row_bounds(A, b, lo, hi)
    point = violation(x, A, b, lo, hi) <= TOLERANCES.lp_feasible
    value = np.where(point, np.einsum("bn,bn->b", c, np.where(point[:, None], x, 0.0)), np.inf)
    lower = dual_bound(c, A, b, y, low, high)
    empty = ~point & proves_empty(A, b, y, low, high, LP_MARGIN)
    flat = ~c.any(axis=1)
    near = value - lower <= GAP * (1 + np.abs(np.where(point, value, 0.0)))
    status = np.full(len(c), int(LPStatus.UNKNOWN))
    status[point & flat] = int(LPStatus.FEASIBLE)
    status[point & ~flat & near] = int(LPStatus.OPTIMAL)
    status[empty] = int(LPStatus.INFEASIBLE)
    lower = np.where(empty, np.inf, np.where(flat, 0.0, lower))
    x = np.where(point[:, None], x, np.nan)
    left = np.flatnonzero(status == int(LPStatus.UNKNOWN))
    for i in left:
        one = solve(c[i], A[i], b[i], lo=lo[i], hi=hi[i])
        status[i] = int(one.status)
        x[i] = one.x
        y[i] = one.multipliers
        lower[i] = one.lower
        value[i] = one.upper
    return LPBatch(status, x, y, lower, value, len(left))
