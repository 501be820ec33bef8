"""Completeness, checked on the finished table and not on how it was made (T17)."""

import math

import numpy as np
from flax import struct

from parc_jax.errors import SoundnessError
from parc_jax.pwa.bits import hash_words

VOLUME_RELATIVE = 1e-12  # [1] largest relative gap between the sum of the volumes and the volume of the domain


@struct.dataclass
class Completeness:
    """What a region table proves about itself.

    volume, domain_volume: sum over the regions, and of the domain. euler: sum over k of (-1)^k (number of k-faces), 1
    for a ball cut into cells. faces: number of k-faces, k = 0..n. n_signs: vertex signs decided. n_exact: vertices that
    were computed in rationals, n_repaired of them for poor floats and not for an undecided sign.
    """

    volume: float
    domain_volume: float
    euler: int
    faces: tuple[int, ...]
    n_signs: int
    n_exact: int
    n_repaired: int

    @property
    def gap(self) -> float:
        """Relative gap between the two volumes."""
        return abs(self.volume - self.domain_volume) / self.domain_volume


def prove_complete(volumes, domain_volume: float, faces, plus, minus, facet_label, facet_count, effort) -> Completeness:
    """Raise SoundnessError unless the regions cover the domain with disjoint interiors.

    plus, minus: bit words (r, words), neurons positive / negative at some vertex of the region. facet_label (F,): >=
    0 for a neuron, < 0 for a domain row; facet_count (F,): regions it bounds. effort: (n_signs, n_exact, n_repaired).
    """
    proof = Completeness(math.fsum(volumes), float(domain_volume), _euler(faces), tuple(faces), *effort)
    if (plus & minus).any():
        _refuse(f"{int((plus & minus).any(axis=1).sum())} regions have vertices on both sides of a neuron")
    if not _all_distinct(plus):
        _refuse("two regions have the same activation pattern")
    if (facet_count != np.where(facet_label >= 0, 2, 1)).any():
        wrong = int((facet_count != np.where(facet_label >= 0, 2, 1)).sum())
        _refuse(f"{wrong} facets do not have one region on each side")
    if proof.euler != 1:
        _refuse(f"the Euler characteristic of its faces {proof.faces} is {proof.euler}, not 1")
    if not proof.gap <= VOLUME_RELATIVE:
        _refuse(
            f"the volumes of its {len(volumes)} regions sum to {proof.volume!r}, the domain has {proof.domain_volume!r}"
        )
    return proof


def _euler(faces) -> int:
    return sum(count if k % 2 == 0 else -count for k, count in enumerate(faces))


def _all_distinct(words: np.ndarray) -> bool:
    """Rows are pairwise different. A hash without collision proves it; otherwise the rows themselves are compared."""
    key = np.sort(hash_words(words))
    return not (key[1:] == key[:-1]).any() or len(np.unique(words, axis=0)) == len(words)


def _refuse(why: str) -> None:
    raise SoundnessError(
        f"region table: not complete, {why}. Nothing may be certified from it; please report the network."
    )
