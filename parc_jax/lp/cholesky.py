"""Cholesky factorisation of tiny matrices as plain elementwise arithmetic.

Written out entry by entry (n <= 10): XLA fuses it over any trailing batch axes, and no LAPACK call is involved, whose
batched form is slow for such sizes and has been seen to hang on machines with few cores.
"""

import jax
import jax.numpy as jnp

Factor = tuple[list[list[jax.Array]], list[jax.Array]]  # strict lower triangle by row, and reciprocals of the diagonal

_FLOOR = 1e-300  # a pivot that rounding made negative: the step is then poor, and the check afterwards says so


def factor(M: list[list[jax.Array]]) -> Factor:
    """M = L L' from the lower triangle M[i][j], j <= i; entries of any one shape."""
    n = len(M)
    L: list[list[jax.Array]] = [[] for _ in range(n)]
    inverse: list[jax.Array] = []
    for i in range(n):
        for j in range(i):
            L[i].append((M[i][j] - dot(L[i][:j], L[j][:j], M[i][j])) * inverse[j])
        pivot = M[i][i] - dot(L[i], L[i], M[i][i])
        inverse.append(jax.lax.rsqrt(jnp.maximum(pivot, _FLOOR)))
    return L, inverse


def solve(factored: Factor, r: list[jax.Array]) -> list[jax.Array]:
    """x with L L' x = r; entries as in `factor`."""
    L, inverse = factored
    n = len(r)
    z: list[jax.Array] = []
    for i in range(n):
        z.append((r[i] - dot(L[i], z, r[i])) * inverse[i])
    for i in reversed(range(n)):
        z[i] = (z[i] - dot([L[k][i] for k in range(i + 1, n)], z[i + 1 :], z[i])) * inverse[i]
    return z


def dot(u: list[jax.Array], v: list[jax.Array], like: jax.Array) -> jax.Array:
    """Sum of products entry by entry; zeros shaped as `like` for empty lists."""
    total = jnp.zeros_like(like)
    for a, b in zip(u, v, strict=True):
        total = total + a * b
    return total
