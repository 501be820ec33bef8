"""Batches of recorded runs."""

import dataclasses
import hashlib
from functools import cached_property

import numpy as np

from parc_jax.common import struct
from parc_jax.common.arrays import Sealed, as_float64, content_hash
from parc_jax.common.errors import InputError
from parc_jax.common.keys import check_seed
from parc_jax.common.sets.box import Box, box
from parc_jax.common.spelling import counted
from parc_jax.learning.labels import Labels
from parc_jax.learning.runs.groups import group_numbers
from parc_jax.learning.runs.law import (
    FITTED,
    LEFT,
    OURS,
    TO_ALL,
    TO_OTHERS,
    TO_TRAINING,
    LawSpec,
    Subject,
    law_spec,
    subject,
)
from parc_jax.learning.system import LARGEST, ONE_POINT, TimeGrid, check_points

FAILED = f"{OURS}failed runs"  # the parameter of the law of a log without them
BY_ROW = ("rows", "k", "p", "q", "groups", "lost")  # the arrays of a batch


@struct.dataclass
class RolloutBatch(Sealed):
    """n runs on one record grid. Build with `rollout_batch`, which validates, or with `collect`.

    rows:   (n,) int64           global row numbers within (seed, stage).
    k:      (n, n_k) float64     parameters that were run.
    p:      (n, n_record + 1, n_c) [m], float64 or float32 storage; columns: the coordinates of all
        reference points, point by point, relative to the start of the first: p[:, 0, :n_p] = 0.
    q:      (n, n_q)             other goal states at t_f.
    domain: Box                  K.
    points: (n_points,)          names of the reference points, static.
    groups: (n,) int64           recording of each row; None = all rows are independent. Rows of one
        group are not: they are split together and count as one.
    lost: (n,) int64             number of times a run was lost with its worker, or slow, and made
        again, -1 for unknown; None = every run was made once.
    rotation: declared behaviour of the heading, None for nothing, static. labels: of coordinates,
        None for plain ones, static. given: axes of k that are measured at the start, static.
    source: hash of the loaded log, its first row and its last, or of a collection, static; rows of
        it that are missing here were left out. None = these very rows.
    time, law, seed, stage: static; seed is the data of the random key; both None for files.
    A failed run holds NaN or infinities and stays: an error without bound, not a missing row.
    """

    rows: np.ndarray
    k: np.ndarray
    p: np.ndarray
    q: np.ndarray
    domain: Box
    time: TimeGrid = struct.field(pytree_node=False)
    law: LawSpec = struct.field(pytree_node=False)
    seed: tuple[int, ...] | None = struct.field(pytree_node=False, default=None)
    stage: int | None = struct.field(pytree_node=False, default=None)
    groups: np.ndarray | None = None
    points: tuple[str, ...] = struct.field(pytree_node=False, default=ONE_POINT)
    rotation: tuple[str, ...] | None = struct.field(pytree_node=False, default=None)
    labels: Labels | None = struct.field(pytree_node=False, default=None)
    given: tuple[int, ...] = struct.field(pytree_node=False, default=())
    lost: np.ndarray | None = None
    source: tuple[str, int, int] | None = struct.field(pytree_node=False, default=None)

    def __repr__(self) -> str:
        return f"RolloutBatch({counted(self.n, 'run')} of {self.name})"

    @property
    def subject(self) -> Subject:
        """Subject of the runs. Raises InputError."""
        about = (self.name, self.domain, self.time, self.n_p, self.n_q)
        return subject(*about, self.points, self.rotation, self.labels, self.given)

    @property
    def n(self) -> int:
        """Number of runs."""
        return self.k.shape[0]

    @property
    def n_k(self) -> int:
        """Number of parameters."""
        return self.k.shape[1]

    @property
    def n_p(self) -> int:
        """Dimension of the workspace."""
        return self.n_c // len(self.points)

    @property
    def n_c(self) -> int:
        """Number of columns: the coordinates of all reference points."""
        return self.p.shape[2]

    @property
    def n_q(self) -> int:
        """Number of other goal states."""
        return self.q.shape[1]

    @property
    def recordings(self) -> int:
        """Number of recordings."""
        return self.n if self.groups is None else len(np.unique(self.groups))

    @property
    def name(self) -> str:
        """Name of the system."""
        return self.law.generator

    @property
    def failed(self) -> np.ndarray:
        """(n,) bool: runs with a NaN or an infinity anywhere."""
        return ~(np.isfinite(self.p).all(axis=(1, 2)) & np.isfinite(self.q).all(axis=1))

    @property
    def finite(self) -> "RolloutBatch":
        """The runs that did not fail; this very batch where none did. Their law then says so: such
        runs may train a network, and neither bound it, nor watch the bound, nor test plans.
        """
        failed = self.failed  # no cached_property: an object that refers to itself is freed late
        if not failed.any():
            return self
        told = tuple(sorted({*self.law.parameters, (FAILED, f"all{LEFT}")}))
        law = dataclasses.replace(self.law, parameters=told)
        return dataclasses.replace(self.select(~failed), law=law)

    def select(self, index) -> "RolloutBatch":
        """The runs picked by an index array, mask or slice (n,)."""
        some = {name: x[index] for name in BY_ROW if (x := getattr(self, name)) is not None}
        return dataclasses.replace(self, **some)

    def split(self, share: float, seed: int = 0) -> tuple["RolloutBatch", "RolloutBatch"]:
        """(the rest, a random share), rows in order, groups undivided. Raises InputError when
        either would be empty.

        To be called before anything is learned from recorded runs: the share is the calibration
        set. A K that was fitted to the runs becomes the smallest box of the rest, see `refitted`.
        """
        if not 0 < share < 1:
            raise InputError(f"holdout: expected a share between 0 and 1; got {share}.")
        groups = np.arange(self.n) if self.groups is None else self.groups
        names = np.unique(groups)
        order = np.random.default_rng(check_seed(seed)).permutation(len(names))
        chosen = np.isin(groups, names[order[: round(share * len(names))]])
        if chosen.all() or not chosen.any():
            raise InputError(
                f"{self.name}: expected enough runs for training and a holdout; got {len(names)}"
                f"{'' if self.groups is None else ' groups'}."
            )
        return refitted(self.select(~chosen), self.select(chosen))

    def hashes(self) -> np.ndarray:
        """(n,) 128-bit content hashes as 32 hex characters: k in float64, p and q rounded to
        float32, so that the same run has the same hash in either storage.
        """
        return self._hashes

    @cached_property
    def _hashes(self) -> np.ndarray:
        def digest(i: int) -> str:  # row by row: a copy of all runs would be large
            told = self.k[i].astype("<f8"), self.p[i].astype("<f4"), self.q[i].astype("<f4")
            # -0.0 is 0.0
            return hashlib.sha256(b"".join((x + 0).tobytes() for x in told)).hexdigest()[:32]

        return np.array([digest(i) for i in range(self.n)], dtype="S32")


def rollout_batch(
    k,
    p,
    q,
    *,
    time: TimeGrid,
    domain: Box,
    law: LawSpec,
    rows=None,
    seed=None,
    stage=None,
    groups=None,
    points=ONE_POINT,
    rotation=None,
    labels=None,
    given=(),
    lost=None,
    source=None,
) -> RolloutBatch:
    """Validated batch, arguments as in `RolloutBatch`. k must be finite and inside the domain; p
    and q may hold NaN (failed runs).

    groups: (n,) whole numbers or names. labels: `Labels`, or a mapping of some of p, q and k, as
        {"k": ("speed [m/s]", ...)}. given: parameters by name or number. source: by default
        these rows are all. Raises InputError.
    """
    require_finite_k(k)
    k = as_float64("rollouts k", k, (None, domain.n))
    n = k.shape[0]
    points = check_points("rollouts", points)
    # a log is its caller's, who may write over it; what was collected is large
    p, q = np.array(p) if seed is None else np.asarray(p), np.array(q, dtype=np.float64)
    if p.dtype != np.float32:
        p = p.astype(np.float64, copy=False)
    n_p = _check_places(p, n, time, points)
    if q.ndim != 2 or q.shape[0] != n:
        raise InputError(
            f"rollouts q: expected shape ({n}, n_q), n_q = 0 without goal states; got {q.shape}."
        )
    outside = ~domain.contains(k)
    if outside.any():
        first = int(np.argmax(outside))
        raise InputError(
            f"rollouts k: {int(outside.sum())} of {n} outside the domain, first row {first}: "
            f"{k[first]}. Widen it?"
        )
    rows = np.arange(n, dtype=np.int64) if rows is None else np.array(rows, np.int64)
    lost = None if lost is None else np.asarray(lost).astype(np.int64)
    if lost is not None and lost.shape != (n,):
        raise InputError(f"rollouts lost: expected shape ({n},); got {lost.shape}.")
    lost = lost if lost is not None and lost.any() else None
    about = subject(law.generator, domain, time, n_p, q.shape[1], points, rotation, labels, given)
    groups = group_numbers(groups, n)
    if source is None and n:
        # the recordings too: two lists of them, or rules for their names, cannot be compared
        content = (k, p[:, -1], q) if groups is None else (k, p[:, -1], q, groups)
        log = content_hash(*content) if seed is None else ""
        source = (log, int(rows.min()), int(rows.max()))
    more = groups, points, about.rotation, about.labels, about.given, lost, source
    return RolloutBatch(rows, k, p, q, domain, time, law, seed, stage, *more)


def _check_places(p: np.ndarray, n: int, time: TimeGrid, points: tuple[str, ...]) -> int:
    """Dimension of the workspace of places p (n, n_record + 1, n_c) of these points, which must be
    relative to the start of the first. Raises InputError.
    """
    if p.ndim != 3 or p.shape[:2] != (n, time.n_record + 1):
        raise InputError(
            f"rollouts p: expected shape ({n}, {time.n_record + 1}, n_p), one row per k, one "
            f"sample per record time; got {p.shape}. Do dt_record and t_f match the recording?"
        )
    n_p, beyond = divmod(p.shape[2], len(points))
    if beyond or n_p < 1:
        raise InputError(
            f"rollouts p: expected columns of {len(points)} reference points "
            f"({', '.join(points)}), equally many each; got {p.shape[2]} columns."
        )
    begin = p[:, 0, :n_p]
    moved = np.isfinite(begin).all(axis=1) & (begin != 0).any(axis=1)
    if moved.any():
        raise InputError(
            "rollouts p: expected positions relative to the start, p[:, 0] = 0; run "
            f"{int(np.argmax(moved))} starts at {begin[np.argmax(moved)]}. Subtract the start"
            f"{'.' if points == ONE_POINT else f' of {points[0]} from all points.'}"
        )
    return n_p


def refitted(train: RolloutBatch, held: RolloutBatch) -> tuple[RolloutBatch, RolloutBatch]:
    """Training runs and others. A K that was fitted to all of them becomes the smallest box of the
    training runs; others outside of it are left out and counted: a claim from the rest is then
    about runs whose k lies in a K that they did not influence.

    Only the training runs state that K is their own smallest box: split again they are fitted
    again, and halves in the wrong order are refused. Raises InputError for these, and for none.
    """
    if held.law.fitted != TO_ALL:
        own = train.k.min(axis=0, initial=np.inf), train.k.max(axis=0, initial=-np.inf)
        if held.law.fitted and not np.array_equal(own, [held.domain.lo, held.domain.hi]):
            others = held.law.fitted.replace(TO_TRAINING, TO_OTHERS)
            told = tuple({**dict(held.law.parameters), FITTED: others}.items())
            held = dataclasses.replace(held, law=dataclasses.replace(held.law, parameters=told))
        return train, held
    if (train.law.fitted or "").startswith(TO_TRAINING):
        raise InputError(
            f"{held.name}: expected a K that the calibration runs had no part in; these are the "
            "half whose smallest box K is, and chose which of the other half are left. Pass the "
            "halves of split() in its order, or declare K: domain=box(lo, hi)."
        )
    domain = box(train.k.min(axis=0), train.k.max(axis=0))
    inside = domain.contains(held.k)
    if not inside.any():
        raise InputError(
            f"{held.name}: expected runs whose k lies in K, the smallest box of the training runs; "
            f"none of {held.n} does. Declare K: domain=box(lo, hi)."
        )
    missed = "" if inside.all() else f", which {held.n - int(inside.sum())} of {held.n} others miss"

    def on(batch: RolloutBatch, words: str) -> RolloutBatch:
        about = dict(batch.law.parameters) | {FITTED: words}
        law = law_spec(batch.law.generator, domain, batch.law.k_law, about)
        return dataclasses.replace(batch, domain=domain, law=law)

    return on(train, TO_ALL), on(held.select(inside), TO_TRAINING + missed)


def require_failed(where: str, law: LawSpec) -> None:
    """Refuse runs whose law says that failed ones were left out. Raises InputError."""
    if FAILED in dict(law.parameters):
        raise InputError(
            f"{where}: expected runs with those that failed, each of which counts as one that "
            "leaves the tube; got runs without, of `finite`. Pass all that were made or logged."
        )


def require_finite_k(k) -> None:
    """Refuse parameters that are not finite, or too large. Raises InputError with the row."""
    k = np.asarray(k)
    if k.ndim != 2 or k.dtype.kind not in "fiu" or (np.abs(k) <= LARGEST).all():
        return  # other faults have other messages
    bad = ~np.isfinite(k).all(axis=1)
    if not bad.any():
        raise InputError(
            f"rollouts k: expected parameters up to {LARGEST:g}; the largest is "
            f"{np.abs(k).max():g}. Tell them in a larger unit."
        )
    row = int(np.argmax(bad))
    raise InputError(
        f"rollouts k: expected finite parameters; row {row} is {k[row]}, {int(bad.sum())} of "
        f"{len(k)} rows in all. A run whose command is not known cannot be used: leave it out."
    )
