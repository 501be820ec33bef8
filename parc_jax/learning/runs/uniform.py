"""Are recorded k uniform on K, as their log declares? The k themselves may refute it.

A claim about uniform k speaks of shares of K, so the word is not believed without a look: at k that
repeat, at the range of every parameter, at pairs of parameters that go together, at corners of K
that are left out. Nothing here shows that k is uniform; a log that passes was not refuted.
"""

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box

# probability, about, with which one look refuses uniform k: over all tests of their distribution,
# and of k that repeat
LEVEL, REPEATS = 1e-3, 1e-6
LEAST = 20  # draws: with fewer nothing is tested
CELLS = 10  # equal parts of a range, fewer where a part would expect less than LEAST / 2 draws
SIDES = (1 / 4, 1 / 3, 1 / 2)  # of a corner, as shares of the ranges of its two parameters


class Chance(NamedTuple):
    """One test. chance: of uniform k to look like this or worse. said: what it found."""

    chance: float
    said: str


def check_uniform(
    owner: str,
    k,
    domain: Box,
    groups=None,
    names: Sequence[str] | None = None,
    level: float = LEVEL,
) -> None:
    """Refuse k (n, n_k) that were not drawn uniformly and independently from the domain, at level
    in all. names: of the parameters. Raises InputError with the figure that refutes it.

    The chances of a rank correlation and of chi-square are approximations, good to a third from
    LEAST draws on; those of corners are exact. groups (n,): rows of one recording may share their k
    or follow each other, so only the first row of each is looked at: that these are independent is
    what a claim about recordings assumes too. The level is split evenly over the kinds of tests,
    and within a kind over its tests.
    """
    drawn = np.ascontiguousarray(k, "<f8")
    _check_distinct(owner, drawn, groups)
    if groups is not None:
        drawn = drawn[np.sort(np.unique(groups, return_index=True)[1])]
    wide = domain.hi > domain.lo
    names = [f"k{axis}" for axis in range(domain.n)] if names is None else list(names)
    names = list(itertools.compress(names, wide))
    u = ((drawn - domain.lo)[:, wide]) / (domain.hi - domain.lo)[wide]
    if len(u) < LEAST:
        return
    kinds = [list(look(u, names)) for look in (_ranges, _pairs, _corners)]
    kinds = [kind for kind in kinds if kind]
    each = [
        Chance(chance * len(kind) * len(kinds), said) for kind in kinds for chance, said in kind
    ]
    worst = min(each, default=Chance(1.0, ""))
    if worst.chance <= level:
        raise InputError(
            f"{owner}: expected k drawn uniformly, as declared; {worst.said}, which uniform draws "
            f"show with a probability of about {worst.chance:.1g}. Leave k_law out, so that the "
            "claim is about k as in the log, or give the K that k was drawn from."
        )


def by_chance(k: np.ndarray, pairs: float) -> float:
    """Equal pairs of uniform k that the resolution of their numbers explains."""
    from scipy.stats import poisson

    bits = 23 if (k == k.astype(np.float32)).all() else 52
    return float(poisson.isf(REPEATS, pairs / 2.0 ** (bits * k.shape[1])))


def _check_distinct(owner: str, k: np.ndarray, groups) -> None:
    """Two independent uniform draws of k are never equal, but for their resolution."""
    if groups is not None:  # windows of one recording may share their k
        number = np.unique(groups, return_inverse=True)[1]
        k = np.unique(np.column_stack([k, number]), axis=0)[:, : k.shape[1]]
    equal = len(k) - len(np.unique(k, axis=0))
    if equal > by_chance(k, len(k) * (len(k) - 1) / 2):
        raise InputError(
            f"{owner}: expected k drawn uniformly, as declared; {equal:,} of {len(k):,} rows "
            "repeat the k of another one. Parts of one recording belong to one group (groups=); "
            "else leave k_law out, so that the claim is about k as in the log."
        )


def _ranges(u: np.ndarray, names: list[str]) -> Iterator[Chance]:
    """Chi-square over equal parts of the range of every parameter."""
    from scipy.stats import chisquare

    cells = min(CELLS, 2 * len(u) // LEAST)
    for axis, name in enumerate(names):
        held = np.histogram(u[:, axis], cells, (0.0, 1.0))[0]
        shown = ", ".join(map(str, held))
        said = f"{cells} equal parts of the range of {name} hold {shown} of {len(u):,} draws"
        yield Chance(float(chisquare(held).pvalue), said)


def _pairs(u: np.ndarray, names: list[str]) -> Iterator[Chance]:
    """Rank correlation of every two parameters."""
    from scipy.stats import spearmanr

    for i, j in itertools.combinations(range(len(names)), 2):
        if np.ptp(u[:, i]) > 0 and np.ptp(u[:, j]) > 0:
            found = spearmanr(u[:, i], u[:, j])
            said = (
                f"the rank correlation of {names[i]} and {names[j]} is {found.statistic:.2f} over "
                f"{len(u):,} draws"
            )
            yield Chance(float(found.pvalue), said)


def _corners(u: np.ndarray, names: list[str]) -> Iterator[Chance]:
    """Draws in boxes at the corners of every two parameters."""
    from scipy.special import bdtr, bdtrc

    for i, j in itertools.combinations(range(len(names)), 2):
        for high in itertools.product((False, True), repeat=2):
            inwards = np.where(high, 1 - u[:, (i, j)], u[:, (i, j)]).max(axis=1)
            for side in SIDES:
                held = int((inwards < side).sum())
                tails = [bdtr(held, len(u), side**2), bdtrc(held - 1, len(u), side**2)]
                ends = " and ".join(
                    f"the {'upper' if up else 'lower'} end of {names[axis]}"
                    for axis, up in zip((i, j), high, strict=True)
                )
                said = (
                    f"a corner of {100 * side**2:.2g} % of K, at {ends}, holds {held:,} of "
                    f"{len(u):,} draws"
                )
                yield Chance(2 * float(min(tails)), said)
