"""Errors of a network at runs, and scores: how much an error shape must grow to hold each. [T1]"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from parc_jax.common.arrays import dot, in_chunks, map_rows, most, x64
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.common.shapes import ManyParams, Numbers, Params, Path, Paths, State, States
from parc_jax.learning.bound.claim import ErrorClaim, check_edges
from parc_jax.learning.bound.counts import RECORDINGS, RUNS, Unit
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.network.predict import Layout, layout_of, predict
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.network.rounding import UNIT, rounding_bound
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.groups import worst_by_group
from parc_jax.learning.runs.independent import Marks, marks_of
from parc_jax.learning.runs.joined import joined_source
from parc_jax.learning.runs.law import LawSpec, Subject

_FLOAT32_UNIT = 2.0**-24  # rounding unit of positions stored in float32
CHUNK = 256  # runs per compiled call: the errors at all records of more take hundreds of MB
FEW = 16  # runs, for which a whole chunk would be a waste
_ROUNDED = 4  # [float spacings of the largest place] by which a difference of records may be off


class Errors(NamedTuple):
    """Error bounds of runs, rounded outward; infinite where a run failed.

    interval: (..., T, n_c) [m]        max over records s in [t, t + 1] of |p(s) - p^(s)|.
    final:    (..., n_c + n_q) [m, .]  |final state - predicted|.
    """

    interval: np.ndarray
    final: np.ndarray


def measure(net: ReLUNetwork, batch: RolloutBatch, chunk: int = CHUNK) -> Errors:
    """Errors of all runs of the batch against the float64 network, as NumPy. Raises InputError."""
    layout = layout_of(batch)
    kernel = partial(_errors_many, net, allowance(net, batch.domain, layout), layout=layout)
    return map_rows(chunk_size(batch.n, chunk), kernel, batch.k, batch.p, batch.q)


def chunk_size(n: int, chunk: int = CHUNK) -> int:
    """Rows per compiled call: one of two sizes, so that few shapes are compiled."""
    return min(chunk, FEW if n <= FEW else chunk)


def allowance(net: ReLUNetwork, domain: Box, layout: Layout) -> Errors:
    """Rounding of network, interpolation, subtraction, over K: interval (T, n_c), final (n_c +
    n_q,). [T10, T11] Raises InputError.
    """
    if net.n_in != domain.n or net.n_out < layout.n_offsets:
        raise InputError(
            f"network: expected {domain.n} inputs and at least {layout.n_offsets} outputs (offsets "
            f"of all reference points at the {layout.n_steps} knots after the start, then q); got "
            f"{net.n_in} inputs, {net.n_out} outputs."
        )
    error, size = rounding_bound(net, domain)
    last = layout.n_offsets - layout.n_c
    at_end = error[last:] + 4 * UNIT * size[last:]
    # interpolation c_t (1 - a) + c_{t+1} a: five roundings, at most UNIT of |c_t| + |c_{t+1}| each
    offsets = (error + 8 * UNIT * size)[: layout.n_offsets]
    knots = np.concatenate([np.zeros(layout.n_p), offsets]).reshape(-1, layout.n_c)
    return Errors(knots[:-1] + knots[1:], at_end)


def _signed(
    net: ReLUNetwork, k: Params, p: Path, q: State, *, layout: Layout
) -> tuple[Errors, Errors]:
    """Signed errors of one run as computed, and the rounding of its storage; p^ is affine between
    knots. interval (T, stride + 1, n_c): a knot counts in both of its intervals.
    """
    c, q_hat, _ = predict(net, layout, k)
    stride = (p.shape[0] - 1) // layout.n_steps
    share = (jnp.arange(stride + 1, dtype=c.dtype) / stride)[None, :, None]
    p_hat = c[:-1, None] * (1 - share) + c[1:, None] * share
    records = jnp.arange(layout.n_steps)[:, None] * stride + jnp.arange(stride + 1)[None]
    unit = _FLOAT32_UNIT if p.dtype == jnp.float32 else 0.0
    run, last = p[records].astype(c.dtype), p[-1].astype(c.dtype)
    return (
        Errors(run - p_hat, jnp.concatenate([last - c[-1], q - q_hat])),
        Errors(unit * jnp.abs(run), jnp.append(unit * jnp.abs(last), jnp.zeros_like(q_hat))),
    )


def rollout_errors(net: ReLUNetwork, k: Params, p: Path, q: State, *, layout: Layout) -> Errors:
    """Errors of one run as computed, p at its records; NaN is infinity. Kernel."""
    error, stored = _signed(net, k, p, q, layout=layout)
    size = Errors(*(jnp.abs(e) + s for e, s in zip(error, stored, strict=True)))
    final = jnp.where(jnp.isnan(size.final), jnp.inf, size.final)
    return Errors(most(size.interval, axis=1), final)


@partial(jax.jit, static_argnames="layout")
def _errors_many(
    net: ReLUNetwork, slack: Errors, k: ManyParams, p: Paths, q: States, *, layout: Layout
) -> Errors:
    errors = jax.vmap(partial(rollout_errors, layout=layout), in_axes=(None, 0, 0, 0))(net, k, p, q)
    up = 1 + 4 * UNIT  # the subtraction itself rounds
    return Errors(*(e * up + more[None] for e, more in zip(errors, slack, strict=True)))


@partial(jax.jit, static_argnames="layout")
def extremes_many(
    net: ReLUNetwork,
    slack: Errors,
    directions: Errors,
    k: ManyParams,
    p: Paths,
    q: States,
    *,
    layout: Layout,
) -> tuple[Errors, Errors]:
    """Least and largest u . error of runs, rounded outward; infinite where a run failed. [T26]

    directions: u of each run, interval (B, T, n_points, R, n_p), final (B, R, n_c + n_q).
    Returns interval (B, T, n_points, R), final (B, R). Called in float64.
    """

    def one(directions: Errors, k: Params, p: Path, q: State):
        error, stored = _signed(net, k, p, q, layout=layout)
        points = (*error.interval.shape[:2], layout.n_points, layout.n_p)
        hidden = stored.interval + slack.interval[:, None]
        low, high = _along(
            directions.interval[:, None], error.interval.reshape(points), hidden.reshape(points)
        )
        low_end, high_end = _along(directions.final, error.final, stored.final + slack.final)
        return Errors(low.min(axis=1), low_end), Errors(high.max(axis=1), high_end)

    return jax.vmap(one)(directions, k, p, q)


def _along(
    u: Float[jax.Array, "*b r n"], error: Float[jax.Array, "*c n"], hidden: Float[jax.Array, "*c n"]
):
    """Least, largest u . e (..., R) for e within `hidden` of error; infinite if not finite."""
    n = error.shape[-1]  # the subtraction rounds, and so do n products and their sum
    middle = dot(u, error[..., None, :])
    pad = dot(jnp.abs(u), (hidden + (n + 4) * UNIT * jnp.abs(error))[..., None, :])
    failed = ~jnp.isfinite(middle + pad)
    return jnp.where(failed, -jnp.inf, middle - pad), jnp.where(failed, jnp.inf, middle + pad)


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of n runs against a profile: S = max over coordinates of |error| / profile, or over
    pairs of faces of |u . error - centre| / half; infinite for a failed run. [T1, T26]

    rows (n,), k (n, n_k), score (n,) float64. worst: (n,) int32, coordinate of the maximum:
        intervals (t, p), or (t, point, pair of faces), first, then final. ids: (n,) content hashes.
    law, subject, seed, stage: of the runs. groups: (n,) recording of each row, None without.
    marks: of recorded runs, to recognise copies. lost: (n,) as of `RolloutBatch`, 0 for none.
    moves: (n, 2, n_c) as of `moves_of`. of: hashes of network and profile.
    """

    rows: np.ndarray
    k: np.ndarray
    score: np.ndarray
    worst: np.ndarray
    ids: np.ndarray
    law: LawSpec
    subject: Subject
    seed: tuple[int, ...] | None
    stage: int | None
    groups: np.ndarray | None = None
    marks: Marks | None = None
    lost: np.ndarray | None = None
    source: tuple[str, int, int] | None = None
    moves: np.ndarray | None = None
    of: tuple[str, str] = ("", "")

    @property
    def n(self) -> int:
        """Number of rows."""
        return self.score.shape[0]

    @property
    def unit(self) -> Unit:
        """Independent unit that the claim counts."""
        return RUNS if self.groups is None else RECORDINGS

    def by_group(self) -> np.ndarray:
        """The independent scores: of every group its worst."""
        return worst_by_group(self.score, self.groups)


def scores_of(net: ReLUNetwork, profile: Tube, batches: Iterable[RolloutBatch]) -> Scores:
    """Scores of runs; a batch is dropped when it is scored. Raises InputError."""
    parts, sources = [], []
    for batch in batches:
        marks = marks_of(batch) if batch.seed is None else None
        lost = np.zeros(batch.n, np.int64) if batch.lost is None else batch.lost
        about = batch.rows, batch.k, batch.hashes(), batch.groups, marks, lost, moves_of(batch)
        parts.append((*about, *_judged(net, profile, batch)))
        sources.append(joined_source([batch]))
    joined = jax.tree.map(lambda *x: np.concatenate(x), *parts)
    rows, k, ids, groups, marks, lost, moves, score, worst = joined
    source = sources[0][0], min(first for _, first, _ in sources), max(x[2] for x in sources)
    runs = batch.law.of(k), batch.subject, batch.seed, batch.stage, groups, marks, lost, source
    return Scores(rows, k, score, worst, ids, *runs, moves, (net.hash, profile.hash))


def moves_of(batch: RolloutBatch) -> np.ndarray:
    """(n, 2, n_c) [m] largest first and second differences of the records of runs, less what
    rounding adds to them; 0 of a failed run. Bounds on speed and acceleration are at least these.
    """
    p = np.where(batch.failed[:, None, None], 0.0, batch.p).astype(batch.p.dtype)
    off = _ROUNDED * np.spacing(np.abs(p).max(axis=1, initial=0.0))
    steps = np.diff(p, axis=1), np.diff(p, 2, axis=1)
    return np.stack([np.abs(step).max(axis=1, initial=0.0) - off for step in steps], axis=1)


def _judged(net: ReLUNetwork, profile: Tube, batch: RolloutBatch) -> tuple[np.ndarray, np.ndarray]:
    check_profile(net, profile, layout_of(batch), batch.domain)
    slack = allowance(net, batch.domain, profile.layout)
    return in_chunks(
        batch.n,
        chunk_size(batch.n),
        lambda rows: score_arrays(net, slack, profile, batch.k[rows], batch.p[rows], batch.q[rows]),
    )


def score_arrays(
    net: ReLUNetwork, slack: Errors, profile: Tube, k: ManyParams, p: Paths, q: States
) -> tuple[np.ndarray, np.ndarray]:
    """Scores (n,) and worst coordinates (n,) of runs. slack: their `allowance`."""
    # on a shared edge a run must fit every bin that it touches
    each = [
        ratios(sizes(net, slack, profile, bins, k, p, q), profile, bins)
        for bins in profile.bins_of(k).T
    ]
    ratio = np.maximum.reduce(each)
    return ratio.max(axis=1), ratio.argmax(axis=1).astype(np.int32)


def kept(
    net: ReLUNetwork, slack: Errors, claim: ErrorClaim, k: ManyParams, p: Paths, q: States
) -> np.ndarray:
    """(n,) bool: runs within the tube at all records, less its part for the time between them, in
    every bin they touch, as in calibration. slack: their `allowance`. A failed run is outside.
    """
    tube, fits = claim.tube, np.ones(len(k), bool)
    between, _ = tube.halves_around(claim.intersample or 0.0, 0.0)
    held = (tube.halves[0] - between, tube.halves[1])
    for bins in tube.bins_of(k).T:
        for size, half in zip(sizes(net, slack, tube, bins, k, p, q), held, strict=True):
            held_by = np.isfinite(size) & (size <= half[bins])  # a failed run has infinite sizes
            fits &= held_by.reshape(len(k), -1).all(axis=1)
    return fits


def sizes(
    net: ReLUNetwork, slack: Errors, tube: Tube, bins: Numbers, k: ManyParams, p: Paths, q: States
) -> Errors:
    """Least `Tube.halves` of the bins (n,) that hold the runs: |error|, or its distance from the
    middle of the faces. Host arrays.
    """
    with x64():
        if tube.templates is None:
            return jax.device_get(_errors_many(net, slack, k, p, q, layout=tube.layout))
        along = Errors(*(faces.directions[bins] for faces in tube.templates))
        least, most = jax.device_get(extremes_many(net, slack, along, k, p, q, layout=tube.layout))
    centres = (faces.centre[bins] for faces in tube.templates)
    parts = zip(least, most, centres, strict=True)
    return Errors(*(np.maximum(high - centre, centre - low) for low, high, centre in parts))


def ratios(needed: Errors, profile: Tube, bins: np.ndarray) -> np.ndarray:
    """(n, coordinates) factor by which every half width of the bins (n,) must grow to `needed`."""
    parts = zip(needed, profile.halves, strict=True)
    return np.concatenate([(e / half[bins]).reshape(len(bins), -1) for e, half in parts], axis=1)


def check_profile(net: ReLUNetwork, profile: Tube, layout: Layout, domain: Box) -> None:
    """Raises InputError where it does not fit network or K, or a width is zero or infinite."""
    n_end = net.n_out - layout.n_offsets + layout.n_c
    if profile.layout != layout or profile.n_c + profile.n_q != n_end or profile.n_k != net.n_in:
        raise InputError(
            f"profile: expected interval (bins, {layout.n_steps}, {layout.n_c}) of "
            f"{layout.n_points} reference points, final (bins, {n_end}), edges for {net.n_in} "
            f"axes; got {profile.interval.shape} of {profile.n_points}, {profile.final.shape}, "
            f"{profile.n_k} axes."
        )
    check_edges(profile, domain)
    widths = np.concatenate([half.reshape(-1) for half in profile.halves])
    if not (np.isfinite(widths).all() and (widths > 0).all()):
        raise InputError(
            "profile: expected finite widths > 0 (a floor); zero would make any error infinite."
        )
