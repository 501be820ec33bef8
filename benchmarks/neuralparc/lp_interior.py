"""Interior-point kernel for tiny linear programs min c.x, {A x <= b}, many along trailing axes.

The simplified homogeneous self-dual embedding (Xu, Hung, Ye 1996) with Mehrotra's predictor and
corrector: it needs no feasible start, and ends either at an optimum (tau > kappa) or at a Farkas
ray (tau < kappa). The number of iterations is fixed, so a batch runs in one compiled loop.
Its answers are hints; `lp_batch` checks them.

Layout: a vector over the n variables is a list of n arrays, a vector over the h rows is one array
with axis 0 = rows. All further axes are batch axes and come last, where the arithmetic vectorises.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

N_ITERATIONS = 18
_STEP = 0.995  # share of the way to the boundary
# complementarity below which an iterate is frozen: further steps would only add rounding
_STOP = 1e-15
_RIDGE = 1e-15  # relative diagonal shift of the normal matrix
# a pivot that rounding made negative: the step is then poor, and the check afterwards says so
_FLOOR = 1e-300

# strict lower triangle by row, and reciprocals of the diagonal
Factor = tuple[list[list[jax.Array]], list[jax.Array]]


class State(NamedTuple):
    """Of the embedding. x: list of n arrays (...). y, s: (h, ...) > 0. tau, kappa: (...) > 0."""

    x: list[jax.Array]
    y: jax.Array
    s: jax.Array
    tau: jax.Array
    kappa: jax.Array


def interior_point(c: list[jax.Array], A: list[jax.Array], b: jax.Array) -> State:
    """c: n arrays (...). A: n columns (h, ...), unit rows, b: (h, ...); padding: A = 0, b = 1.

    If tau > kappa: x / tau is nearly optimal, y / tau nearly dual optimal. Otherwise y is nearly a
    Farkas ray, or x a ray of descent.
    """
    one = jnp.ones_like(c[0])
    start = State([jnp.zeros_like(one) for _ in A], jnp.ones_like(b), jnp.ones_like(b), one, one)
    return jax.lax.fori_loop(0, N_ITERATIONS, lambda _, state: _iterate(c, A, b, state), start)


def _iterate(c, A, b, st: State) -> State:
    """One predictor-corrector step; a converged or broken iterate stays where it is."""
    h = b.shape[0]
    zero = st.tau
    D = st.y / st.s
    scaled = [column * D for column in A]
    M = [[(scaled[i] * A[j]).sum(0) for j in range(i + 1)] for i in range(len(A))]
    ridge = _RIDGE * sum(M[i][i] for i in range(1, len(A))) + _RIDGE * M[0][0]
    for i in range(len(A)):
        M[i][i] = M[i][i] + ridge
    factored = factor(M)

    dual_gap = [-(g + c_j * st.tau) for g, c_j in zip(_transposed(A, st.y), c, strict=True)]
    row_gap = -(_rows(A, st.x) + st.s - b * st.tau[None])
    value_gap = -(dot(c, st.x, zero) + (b * st.y).sum(0) + st.kappa)
    mu = ((st.s * st.y).sum(0) + st.tau * st.kappa) / (h + 1.0)

    # The direction is affine in the step of tau: dx = u + v dtau; v is shared by predictor and
    # corrector.
    v = solve_factored(factored, [g - c_j for g, c_j in zip(_transposed(A, D * b), c, strict=True)])
    dy_per_tau = D * (_rows(A, v) - b)
    slope = dot(c, v, zero) + (b * dy_per_tau).sum(0) - st.kappa / st.tau

    def direction(eta, to_center, to_center_tau) -> State:
        """Newton direction: the share eta of the gaps goes, s*y and tau*kappa aim at targets."""
        pull = D * row_gap * eta[None] - to_center / st.s
        u = solve_factored(
            factored, [eta * r + g for r, g in zip(dual_gap, _transposed(A, pull), strict=True)]
        )
        dy_fixed = D * _rows(A, u) - pull
        dtau = (
            eta * value_gap - dot(c, u, zero) - (b * dy_fixed).sum(0) - to_center_tau / st.tau
        ) / slope
        dy = dy_fixed + dy_per_tau * dtau[None]
        return State(
            [p + q * dtau for p, q in zip(u, v, strict=True)],
            dy,
            (to_center - st.s * dy) / st.y,
            dtau,
            (to_center_tau - st.kappa * dtau) / st.tau,
        )

    guess = direction(jnp.ones_like(mu), -st.s * st.y, -st.tau * st.kappa)
    sigma = (1.0 - jnp.minimum(_longest_step(st, guess), 1.0)) ** 3
    step = direction(
        1.0 - sigma,
        (sigma * mu)[None] - st.s * st.y - guess.s * guess.y,
        sigma * mu - st.tau * st.kappa - guess.tau * guess.kappa,
    )
    length = jnp.minimum(_STEP * _longest_step(st, step), 1.0)
    new = jax.tree.map(lambda old, change: old + _over_rows(length, old) * change, st, step)
    total = sum(new.x[1:], new.x[0]) + new.y.sum(0) + new.s.sum(0) + new.tau + new.kappa
    move = (mu > _STOP) & jnp.isfinite(total) & (new.tau > 0) & (new.kappa > 0)
    return jax.tree.map(lambda old, now: jnp.where(_over_rows(move, old), now, old), st, new)


def _longest_step(st: State, step: State):
    """Largest step after which y, s, tau and kappa are nonnegative."""
    limit = jnp.minimum(_limit(st.y, step.y).min(0), _limit(st.s, step.s).min(0))
    return jnp.minimum(limit, jnp.minimum(_limit(st.tau, step.tau), _limit(st.kappa, step.kappa)))


def _over_rows(scalar, like):
    """A per-program scalar (...) beside an array (...) or (h, ...)."""
    return scalar if like.ndim == scalar.ndim else scalar[None]


def _limit(value, change):
    return jnp.where(change < 0, -value / change, jnp.inf)


def _rows(A, x):
    """A x: (h, ...)."""
    total = A[0] * x[0][None]
    for column, x_j in zip(A[1:], x[1:], strict=True):
        total = total + column * x_j[None]
    return total


def _transposed(A, y):
    """A'y: list of n arrays."""
    return [(column * y).sum(0) for column in A]


# Cholesky factorisation written out entry by entry (n <= 10): XLA fuses it over any trailing batch
# axes, and no LAPACK call is involved, whose batched form is slow for such sizes and has been seen
# to hang on machines with few cores.


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


def solve_factored(factored: Factor, r: list[jax.Array]) -> list[jax.Array]:
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
