"""From a prior and few real runs to training data for a network."""

from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, generator, stream
from parc_jax.learning.prior.identify import (
    chosen_kind,
    corrected,
    fitted,
    flat,
    largest,
    log_sizes,
    moving_body,
)
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.law import SAID, STATED, subject_of

TWIST = "twist"
REPEATS = 8  # runs of a simulator at the k of a real run: their mean is its prediction
_LEAST = 10  # finite real runs, without which nothing can be corrected or tried


class Taught(NamedTuple):
    """Training data for a network. runs: of the corrected prior. unseen: the finite real runs, as
    far from it as by cross-validation. size: (n_train,) [m] largest error of each real run in a
    coordinate, infinite for a failed one. said: a sentence about prior and residuals. ran: rows of
    the PRIOR stream that a simulator was run for.
    """

    runs: RolloutBatch
    unseen: RolloutBatch
    size: np.ndarray
    said: str
    ran: int = 0


def taught(prior, train: RolloutBatch, n: int, key: jax.Array) -> Taught:
    """n runs of a prior that is corrected by recorded runs `train`, k uniform on their domain.

    prior: TWIST, for a robot that is one body in the plane; or any system of the time grid, points
        and goal states of the runs, whose domain holds theirs. Raises InputError.
    """
    usable = ~train.failed
    _check(train, usable, " that are finite")
    rng, ran = generator(stream(key, Stage.TRAIN)), 0
    k = rng.uniform(train.domain.lo, train.domain.hi, (n, train.n_k))
    if prior == TWIST:
        finite = train.select(usable)
        kind = chosen_kind(moving_body(finite))

        def at(rows: np.ndarray, k: np.ndarray) -> np.ndarray:
            p, q = fitted(moving_body(finite.select(rows)), kind).rollout_batch(None, k)
            return np.concatenate([p.reshape(len(k), -1), q], axis=1)

        at_runs, drawn = lambda rows: at(rows, finite.k), at(np.ones(finite.n, bool), k)
        said = f"prior twist, order {kind.order} in k and {kind.degree} in time"
    elif isinstance(prior, str):
        raise InputError(f'prior: expected "{TWIST}" or a system; got {prior!r:.40}.')
    else:
        require_like(prior, train)
        repeated = _run(prior, np.repeat(train.k, REPEATS, axis=0), key)
        at_all = repeated.reshape(train.n, REPEATS, -1).mean(axis=1)
        usable, ran = usable & np.isfinite(at_all).all(axis=1), max(n, len(repeated))
        _check(train, usable, f" that are finite, and that {prior.name} can do too")
        finite = train.select(usable)
        at_runs, drawn, said = lambda _: at_all[usable], _run(prior, k, key), f"prior {prior.name}"
    better = corrected(at_runs, finite)
    alone = corrected(lambda _: np.zeros_like(flat(finite)), finite)
    if log_sizes(finite, alone.errors).mean() < log_sizes(finite, better.errors).mean():
        better, drawn, said = alone, np.zeros_like(drawn), f"{said}, left out: the runs alone"
    size = np.full(train.n, np.inf)
    size[usable] = largest(finite, better.errors)
    unseen = _like(finite, better.predicted + better.errors)
    runs = finite.select(np.zeros(n, int)).replace(rows=np.arange(n), k=k, groups=None)
    runs = _like(runs, drawn + better.more(k))
    return Taught(runs, unseen, size, f"{said}; {better.details()}", ran)


def _run(system, k: np.ndarray, key: jax.Array) -> np.ndarray:
    return flat(collect(system, key, len(k), Stage.PRIOR, k=k, quiet=True))


def require_like(prior, runs: RolloutBatch) -> None:
    """Refuse a simulator that does not fit these runs. Raises InputError."""
    where = f"prior {prior.name}: the recorded runs and the simulator"
    both = own, other = runs.subject, subject_of(prior)
    # a simulator may call coordinates otherwise, but not have the same ones in another order
    names = {part: [sorted(getattr(one.labels, part)) for one in both] for part in SAID}
    free = [SAID[part] for part, (one, two) in names.items() if one != two]
    free += STATED[:-1] if other.given else STATED  # by silence nothing measured is dropped
    own.agree(where, other, ("K", *free), "Of a log, say what was measured: given, --given.")
    if not prior.domain.contains(np.stack([runs.domain.lo, runs.domain.hi])).all():
        raise InputError(
            f"prior {prior.name}: expected a domain that holds that of the recorded runs, "
            f"{runs.domain.lo} to {runs.domain.hi}; got {prior.domain.lo} to {prior.domain.hi}."
        )


def _check(train: RolloutBatch, usable: np.ndarray, which: str) -> None:
    if usable.sum() < _LEAST:
        raise InputError(
            f"prior: expected at least {_LEAST} training runs{which}; got {int(usable.sum())} of "
            f"{train.n}."
        )
    still = train.domain.hi <= train.domain.lo
    if still.any():
        raise InputError(
            f"prior: expected every parameter to vary; axis {still.argmax()} is constant. Omit it."
        )


def _like(runs: RolloutBatch, places: np.ndarray) -> RolloutBatch:
    """Runs with other places and goal states, flat (n, m)."""
    m = places.shape[1] - runs.n_q
    return runs.replace(p=places[:, :m].reshape(runs.n, *runs.p.shape[1:]), q=places[:, m:])
