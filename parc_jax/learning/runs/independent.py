"""Tests of recorded runs as independent draws: copies up to storage and printing, and k that are
declared uniform on K, tested by repeated k, ranges, correlations, corners of K that are left out.

A log that passes is not refuted; nothing here shows that k is uniform.
"""

import itertools
from collections.abc import Collection, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from parc_jax.common.arrays import content_hash
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.runs.batch import RolloutBatch

_TIMES = 8  # records of a run that are compared
LEAST_LENGTH = 1e-300  # [m], of a run that stands still
_CHANCE = 1e-3  # of more near pairs among independent uniform draws than are tolerated
_NEAR = 0.05  # of two runs of one k that are near by chance: a noise of 2e-4 of a length, in 1-D


class Marks(NamedTuple):
    """Features to recognise copies: k (n, n_k), p (n, ..., n_c) at some records, q (n, n_q)."""

    k: np.ndarray
    p: np.ndarray
    q: np.ndarray


def marks_of(batch: RolloutBatch) -> Marks:
    """The marks of every run of a batch."""
    records = np.unique(np.linspace(0, batch.time.n_record, _TIMES + 1).astype(int)[1:])
    return Marks(batch.k, batch.p[:, records].astype(np.float64), batch.q)


def near_copies(one: Marks, other: Marks | None, width: np.ndarray) -> np.ndarray:
    """Pairs (m, 2) of rows, of `one` and of `other` (None = of `one` again), that are the same run
    but for `TOLERANCES.near_k` and `near_p`. Failed runs are not compared.

    width: (n_k,) of K. None when there are no more pairs than chance explains: for k drawn
    uniformly by a system without disturbance, and of `other` for runs of one k. Pairs of equal
    marks do not count: copies are known by content, others are told too coarsely.
    """
    from scipy.spatial import cKDTree
    from scipy.stats import binom

    both = one if other is None else Marks(*map(np.concatenate, zip(one, other, strict=True)))
    p, n = both.p.reshape(len(both.p), -1), len(one.k)
    finite = np.isfinite(np.hstack([p, both.q])).all(axis=1)
    k, p, q = both.k[finite], p[finite], both.q[finite]
    # by the length of each run, so that neither those that stand nor one that diverged hide others
    length = np.abs(p).max(axis=1, initial=LEAST_LENGTH)[:, None]
    # half of each: where a p and the length are both off, their quotient is by twice as much
    parts = p / length / 2, np.log(length) / 2, q / np.abs(q).max(axis=0, initial=LEAST_LENGTH)
    told = np.hstack([k, p.astype(np.float32), q.astype(np.float32)])  # as in a hash of content
    k = k / (TOLERANCES.near_k * np.where(width > 0, width, 1.0))
    rows = np.hstack([k, *(part / TOLERANCES.near_p for part in parts)])
    m = int(finite[:n].sum())
    tree, tries = cKDTree(rows[:m] if other is None else rows[m:]), n * (n - 1) // 2
    if other is None:
        at = np.sort(tree.query_pairs(1.0, p=np.inf, output_type="ndarray"), axis=1)
    else:
        which = tree.query(rows[:m], p=np.inf, distance_upper_bound=1.0)[1]
        at = np.column_stack([np.arange(m), m + which])[which < tree.n]
    equal = (told[at[:, 0]] == told[at[:, 1]]).all(axis=1)
    chance = (2 * TOLERANCES.near_k) ** len(width)  # of near k
    if other is not None and not equal.all():
        mates = tree.query_ball_point(rows[m:], 1.0, p=np.inf, return_length=True)
        _, same, times = np.unique(told[m:], axis=0, return_inverse=True, return_counts=True)
        by_chance = _by_chance(np.round(k), mates - times[same.ravel()])
        by_chance[at[equal, 0]] = 0.0
        tries = m - int(equal.sum())
        chance = min(chance * tree.n + by_chance.sum() / tries, 1.0)
    pairs = (np.flatnonzero(finite)[at] - [0, 0 if other is None else n])[np.lexsort(at.T[::-1])]
    return pairs if (~equal).sum() > binom.isf(_CHANCE, tries, chance) else pairs[:0]


def _by_chance(k: np.ndarray, mates: np.ndarray) -> np.ndarray:
    """Probability that each of the first runs is near one of the last of its k by chance, as these
    are near each other. k: (m + n, n_k) of both. mates: (n,) number near each of the last.
    """
    of = np.unique(k, axis=0, return_inverse=True)[1].ravel()
    first, last = np.split(of, [len(of) - len(mates)])
    many = np.bincount(last, minlength=of.max() + 1)
    near, pairs = mates.sum(), (many * (many - 1)).sum()
    each = min(_NEAR, (near + 3 * np.sqrt(near) + 3) / max(pairs, 1))
    # one run in three storages has two mates; more have ends that feedback makes alike
    alike = np.bincount(last, mates > 2, len(many)) / np.maximum(many, 1)
    return np.minimum(alike + each * many, 1.0)[first]


# probability, about, of refusing uniform k: by all tests of their distribution, and for repeated k
LEVEL, REPEATS = 1e-3, 1e-6
LEAST = 20  # draws: with fewer nothing is tested
CELLS = 10  # equal parts of a range, fewer where a part would expect less than LEAST / 2 draws
SIDES = (1 / 4, 1 / 3, 1 / 2)  # of a corner, as shares of the ranges of its two parameters
FEWEST = 25  # values of a parameter that are the decimals of draws; fewer are choices
MANY = 200  # the same of steps of other sizes, as of degrees told in rad
FINEST = 2.0**23  # values that a generator of random numbers in single precision has
Chance = tuple[float, str]  # p-value of a test for uniform k, and its result in words


def check_uniform(
    owner: str, k, domain: Box, groups=None, names: Sequence[str] | None = None, level=LEVEL
) -> None:
    """Refuse k (n, n_k) that were not drawn uniformly and independently from the domain, at level
    in all. names: of the parameters. Raises InputError with the figure that refutes it.

    Most p-values are approximations, good to a third from LEAST draws on. groups (n,): rows of one
    recording may share their k or follow each other, so only the first of each is tested, as claims
    about recordings assume these independent. The level is split over kinds, then over tests.
    """
    drawn = np.ascontiguousarray(k, "<f8")
    _check_distinct(owner, drawn, groups, domain)
    if groups is not None:
        drawn = drawn[np.sort(np.unique(groups, return_index=True)[1])]
    wide = domain.hi > domain.lo
    names = [f"k{i}" if names is None else names[i] for i in np.flatnonzero(wide)]
    told = ((drawn - domain.lo)[:, wide]) / (domain.hi - domain.lo)[wide]
    if len(told) < LEAST:
        return
    steps, rounded = (part[wide] for part in values_of(drawn, domain))
    # rounded draws, moved by what rounding may have moved them, are uniform again
    u = told + (np.random.default_rng(0).random(told.shape) - 0.5) / steps
    u = 1 - np.abs(1 - np.abs(u))
    kinds = [list(test(u, names)) for test in (_ranges, _pairs, _corners)]
    kinds = [kind for kind in (*kinds, list(_repeats(told, names, steps, rounded))) if kind]
    scaled = ((chance * len(kind) * len(kinds), said) for kind in kinds for chance, said in kind)
    chance, said = min(scaled, default=(1.0, ""))
    if chance <= level:
        raise InputError(
            f"{owner}: expected k drawn uniformly, as declared; {said}, which uniform draws "
            f"show with a probability of about {chance:.1g}. Leave k_law out, so that the "
            "claim is about k as in the log, or give the K that k was drawn from."
        )


def values_of(k: np.ndarray, domain: Box) -> tuple[np.ndarray, np.ndarray]:
    """(n_k,) most values of k (n, n_k) in a domain, as stored or rounded; (n_k,) bool: rounded."""
    stored = np.float32 if (k == k.astype(np.float32)).all() else np.float64
    width = 2 * domain.radius
    fine = np.spacing(np.maximum(-domain.lo, domain.hi).astype(stored)).astype(float)
    step = np.array([_step(*axis) for axis in zip(k.T, fine, width, strict=True)])
    for size in 10.0 ** np.arange(-12, 7):
        even = (np.abs(k - size * np.round(k / size)) < 0.01 * size + fine / 2).all(axis=0)
        even &= (size > np.maximum(step, 4 * fine)) & (FEWEST * size <= width)
        step = np.where(even, size, step)
    return np.maximum(width / step, 1.0), step > fine


def _step(x: np.ndarray, fine: float, width: float) -> float:
    """Largest step of which x (n,) differ by multiples, by Euclid; `fine` where none is seen."""
    gaps, near, step = np.diff(np.unique(x)), max(1e-7 * width, 256 * fine), width
    while (rest := np.abs(gaps - step * np.round(gaps / step))).max(initial=0.0) > near:
        step = rest[rest > near].min()
    return step if 20 * near <= step <= width / MANY and len(gaps) > CELLS else fine


def step_of(places: np.ndarray) -> float:
    """[m] Of the columns of places (..., n_c) the largest that its values are apart at least, but
    for 1e-12 of them; 0 where all are constant.
    """
    x = places.reshape(-1, places.shape[-1])
    x = np.sort(x[np.isfinite(x).all(axis=1)], axis=0)
    gaps = np.diff(x, axis=0)
    seen = gaps > 1e-12 * np.maximum(np.abs(x[1:]), np.abs(x[:-1]))
    least = np.where(seen, gaps, np.inf).min(axis=0, initial=np.inf)
    return float(least[np.isfinite(least)].max(initial=0.0))


def by_chance(k: np.ndarray, pairs: float, domain: Box) -> float:
    """Bound on equal pairs of k (n, n_k) uniform on a domain, in the resolution they stand in."""
    from scipy.stats import poisson

    values = float(values_of(k, domain)[0].prod())
    # of few values the tail is that of chi-square, which is heavier
    heavier = -np.log(REPEATS) * np.sqrt(2 * pairs) / values
    return float(poisson.isf(REPEATS, pairs / values) + heavier)


def marks_by_k(k: np.ndarray) -> list[str]:
    """Of each k (n, n_k) 48 bits of a hash in float32, of all copies of a run: -0.0 is 0.0."""
    return [content_hash(row)[:12] for row in np.asarray(k, np.float32) + 0]


def repeated(runs: Any, marks: Collection[str]) -> np.ndarray:
    """(n,) bool: runs, a batch or `Scores`, whose k have one of these marks, if more have than
    chance explains. None of a law other than uniform, whose k may repeat.
    """
    found, k, K = np.isin(marks_by_k(runs.k), list(marks)), np.float32(runs.k), runs.subject.domain
    even = runs.law.k_law == "uniform" and found.any()
    return found & (even and found.sum() > by_chance(k, len(k) * len(marks), K))


def _check_distinct(owner: str, k: np.ndarray, groups, domain: Box) -> None:
    """Two independent uniform draws of k are never equal, but for their resolution."""
    if groups is not None:  # windows of one recording may share their k
        number = np.unique(groups, return_inverse=True)[1]
        k = np.unique(np.column_stack([k, number]), axis=0)[:, : k.shape[1]]
    equal = len(k) - len(np.unique(k, axis=0))
    if equal and equal > by_chance(k, len(k) * (len(k) - 1) / 2, domain):
        raise InputError(
            f"{owner}: expected k drawn uniformly, as declared; {equal:,} of {len(k):,} rows "
            "repeat the k of another one. Parts of one recording belong to one group (groups=); "
            "else leave k_law out, so that the claim is about k as in the log."
        )


def _ranges(u: np.ndarray, names: list[str]) -> Iterator[Chance]:
    """Chi-square over equal parts of every range, and pairs in one of as many parts as draws."""
    from scipy.stats import chi2, chisquare, poisson

    n = len(u)
    cells = min(CELLS, 2 * n // LEAST)
    for axis, name in enumerate(names):
        held = np.histogram(u[:, axis], cells, (0.0, 1.0))[0]
        far, less = chisquare(held)
        # whole counts of equal parts are never nearer to each other than by this
        more = chi2.cdf(far + cells**2 / (6 * n), cells - 1)
        shown = ", ".join(map(str, held))
        said = f"{cells} equal parts of the range of {name} hold {shown} of {n:,} draws"
        yield 2 * float(min(less, more)), said + " (more even than draws)" * int(more < less)
        pairs = _equal(np.floor(0.97 * n * u[:, axis] + 0.3))  # edges of parts are on no grid
        said = f"values of {name} are more even than draws, {pairs:,} pairs in about {n:,} parts"
        yield float(poisson.cdf(pairs, (n - 1) / 2 / (0.97 + 1.3 / n))), said


def _repeats(told, names: list[str], values: np.ndarray, rounded) -> Iterator[Chance]:
    """Equal values of a parameter, too many, and equal rows, too few, of u as told in the log."""
    from scipy.stats import chi2, poisson

    n = len(told)
    for axis, name in enumerate(names):
        least, some = min(values[axis], FINEST), len(np.unique(told[:, axis]))
        due, pairs = n * (n - 1) / 2 / least, _equal(told[:, axis])
        far = (pairs - due) / np.sqrt(due / (2 * least)) + least
        chance = max(poisson.sf(pairs - 1, due), chi2.sf(far, least))
        yield float(chance), f"{name} has only {some:,} values in {n:,} draws, as on a grid"
    if rounded.all():  # floats are finer towards 0, so that fewer are due
        pairs, due = _equal(told), n * (n - 1) / 2 / float((values + 1).prod())
        said = f"only {pairs:,} pairs of {n:,} draws are equal, more even than draws"
        yield float(poisson.cdf(pairs, due)), f"{said} of so few decimals"


def _equal(x: np.ndarray) -> int:
    """Number of pairs of equal rows."""
    many = np.unique(x, axis=0, return_counts=True)[1]
    return int((many * (many - 1) // 2).sum())


def _pairs(u: np.ndarray, names: list[str]) -> Iterator[Chance]:
    """Rank correlation of every two parameters."""
    from scipy.stats import spearmanr

    for i, j in itertools.combinations(range(len(names)), 2):
        if np.ptp(u[:, i]) > 0 and np.ptp(u[:, j]) > 0:
            result = spearmanr(u[:, i], u[:, j])
            said = f"{names[i]} and {names[j]} is {result.statistic:.2f} over {len(u):,} draws"
            yield float(result.pvalue), f"the rank correlation of {said}"


def _corners(u: np.ndarray, names: list[str]) -> Iterator[Chance]:
    """Draws in boxes at the corners of every two parameters."""
    from scipy.special import bdtr, bdtrc

    for i, j in itertools.combinations(range(len(names)), 2):
        for high in itertools.product((False, True), repeat=2):
            inwards = np.where(high, 1 - u[:, (i, j)], u[:, (i, j)]).max(axis=1)
            for side in SIDES:
                held = int((inwards < side).sum())
                tails = [bdtr(held, len(u), side**2), bdtrc(held - 1, len(u), side**2)]
                one, two = ("upper" if up else "lower" for up in high)
                said = f"the {one} end of {names[i]} and the {two} end of {names[j]}, holds"
                said = f"a corner of {100 * side**2:.2g} % of K, at {said}"
                yield 2 * float(min(tails)), f"{said} {held:,} of {len(u):,} draws"
