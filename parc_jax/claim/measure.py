"""Measured errors: how far recorded runs are from the network, per interval and at the end."""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.arrays import x64
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.network.predict import Layout, layout_of, predict
from parc_jax.network.relu import ReLUNetwork
from parc_jax.network.rounding import UNIT, rounding_bound
from parc_jax.rollout.batch import RolloutBatch
from parc_jax.rollout.forecast import Forecast
from parc_jax.rollout.rows import map_rows, simulate_rows
from parc_jax.sets.box import Box

_FLOAT32_UNIT = 2.0**-24  # rounding unit of positions stored in float32


class Errors(NamedTuple):
    """Error bounds of runs, rounded outward; infinite where a run failed.

    interval: (..., T, n_c) [m]        max over the records s in the closed interval [t, t + 1] of
        |p(s) - p^(s)|, for the coordinates of all reference points.
    final:    (..., n_c + n_q) [m, .]  |final state - predicted|.
    """

    interval: np.ndarray
    final: np.ndarray


class Allowance(NamedTuple):
    """What float64 evaluation may hide, added to every error. interval: (T, n_c), final: (n_c +
    n_q,). [T10, T11]
    """

    interval: np.ndarray
    final: np.ndarray


def measure(net: ReLUNetwork, batch: RolloutBatch, chunk: int = 1024) -> Errors:
    """Errors of every run of the batch against the float64 network, host arrays. Raises
    InputError.
    """
    layout = layout_of(batch)
    slack = allowance(net, batch.domain, layout)
    parts = []
    chunk = min(chunk, 1 << max(batch.n - 1, 1).bit_length())  # few shapes, few compilations
    for start in range(0, batch.n, chunk):
        rows = np.minimum(np.arange(start, start + chunk), batch.n - 1)
        errors = measure_arrays(net, slack, layout, batch.k[rows], batch.p[rows], batch.q[rows])
        parts.append(Errors(*(np.asarray(e)[: batch.n - start] for e in errors)))
    return Errors(*(np.concatenate(e) for e in zip(*parts, strict=True)))


def measure_system(
    net: ReLUNetwork,
    system,
    key,
    n: int,
    stage: Stage,
    *,
    k=None,
    first_row=0,
    path=None,
    quiet=False,
    title: str | None = None,
    forecast: Forecast | None = None,
) -> tuple[np.ndarray, Errors]:
    """Parameters (n, n_k) and errors of n runs of a system that are never held. Arguments as in
    `collect`.
    """
    layout = layout_of(system)
    slack = allowance(net, system.domain, layout)

    def work(rows, device):
        drawn, (p, q) = simulate_rows(system, key, stage, rows, k, first_row, device)
        errors = measure_arrays(net, slack, layout, drawn, p, q)
        return {
            "k": drawn,
            "interval": np.asarray(errors.interval),
            "final": np.asarray(errors.final),
        }

    label = {"what": "errors", "network": net.hash}
    stream = map_rows(
        work,
        system,
        key,
        n,
        stage,
        k=k,
        first_row=first_row,
        path=path,
        quiet=quiet,
        title=title,
        forecast=forecast,
        label=label,
    )
    parts = [arrays for _, arrays in stream]
    k, interval, final = (
        np.concatenate([part[name] for part in parts]) for name in ("k", "interval", "final")
    )
    return k, Errors(interval, final)


def measure_arrays(net: ReLUNetwork, slack: Allowance, layout: Layout, k, p, q) -> Errors:
    """Errors (B, ...) of runs k (B, n_k), p (B, n_record + 1, n_c), q (B, n_q), left on their
    device.
    """
    with x64():
        return _errors_many(
            net, slack, jnp.asarray(k), jnp.asarray(p), jnp.asarray(q), layout=layout
        )


def allowance(net: ReLUNetwork, domain: Box, layout: Layout) -> Allowance:
    """Rounding of network, interpolation and subtraction over all of K. [T10, T11] Raises
    InputError.
    """
    if net.n_in != domain.n or net.n_out < layout.n_offsets:
        raise InputError(
            f"network: expected {domain.n} inputs and at least {layout.n_offsets} outputs (offsets "
            f"of {layout.n_points} points in {layout.n_p} dimensions at {layout.n_steps} knots "
            f"after the first, then q); got {net.n_in} inputs, {net.n_out} outputs."
        )
    error, size = rounding_bound(net, domain)
    first_at_end = layout.n_offsets - layout.n_c
    at_end = error[first_at_end:] + 4 * UNIT * size[first_at_end:]
    # interpolation c_t (1 - a) + c_{t+1} a: five roundings, each at most UNIT of a magnitude below
    # |c_t| + |c_{t+1}|
    each = (error + 8 * UNIT * size)[: layout.n_offsets]
    knots = np.concatenate([np.zeros(layout.n_p), each]).reshape(-1, layout.n_c)
    return Allowance(knots[:-1] + knots[1:], at_end)


def rollout_errors(net: ReLUNetwork, k, p, q, *, layout: Layout) -> Errors:
    """Errors of one run, as computed: k (n_k,), p (n_record + 1, n_c), q (n_q,). p^ is affine
    between knots.

    Both end records of an interval belong to it, so a knot counts in two intervals. NaN becomes
    infinity.
    """
    T = layout.n_steps
    stride = (p.shape[0] - 1) // T
    c, q_hat, _ = predict(net, layout, k)
    share = (jnp.arange(stride + 1, dtype=c.dtype) / stride)[None, :, None]
    p_hat = c[:-1, None] * (1 - share) + c[1:, None] * share
    records = jnp.arange(T)[:, None] * stride + jnp.arange(stride + 1)[None]
    seen = p[records]
    stored = _FLOAT32_UNIT if p.dtype == jnp.float32 else 0.0
    seen = seen.astype(c.dtype)
    gap = jnp.abs(seen - p_hat) + stored * jnp.abs(seen)
    last = p[-1].astype(c.dtype)
    end = jnp.concatenate([jnp.abs(last - c[-1]) + stored * jnp.abs(last), jnp.abs(q - q_hat)])
    return Errors(_failures_to_infinity(gap.max(axis=1)), _failures_to_infinity(end))


@partial(jax.jit, static_argnames="layout")
def _errors_many(net, slack, k, p, q, *, layout):
    errors = jax.vmap(partial(rollout_errors, layout=layout), in_axes=(None, 0, 0, 0))(net, k, p, q)
    up = 1 + 4 * UNIT  # the subtraction itself rounds
    return Errors(
        errors.interval * up + slack.interval[None], errors.final * up + slack.final[None]
    )


def _failures_to_infinity(x):
    return jnp.where(jnp.isnan(x), jnp.inf, x)
