"""Completeness, checked on the finished table and not on how it was made [T17]: a forward pass from
the weights at the final vertices, then faces and volumes.
"""

import math

import numpy as np
from jaxtyping import Float, Int, UInt64

from parc_jax.common import struct
from parc_jax.common.arrays import slices
from parc_jax.common.errors import SoundnessError
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.regions.rounding import SAFETY, forward
from parc_jax.proof.regions.storage import hash_words, unpack

# [1] largest relative gap between the sum of the volumes and the volume of the domain
VOLUME_RELATIVE = 1e-12
CHUNK = 1 << 12  # vertices treated at once, so that the working set stays in cache


@struct.dataclass
class Completeness:
    """The proof of completeness of a region table.

    volume, domain_volume: sum over the regions, and of the domain.
    euler: sum over k of (-1)^k (number of k-faces), 1 for a ball cut into cells.
    faces: number of k-faces, k = 0..n. n_signs: vertex signs decided. n_exact: vertices computed
    in rationals, for an open sign or a poor float.
    """

    volume: float
    domain_volume: float
    euler: int
    faces: tuple[int, ...]
    n_signs: int
    n_exact: int

    @property
    def gap(self) -> float:
        """Relative gap between the two volumes."""
        return abs(self.volume - self.domain_volume) / self.domain_volume


def prove_complete(
    volumes: Float[np.ndarray, " r"],
    domain_volume: float,
    faces: list[int],
    plus: UInt64[np.ndarray, "r words"],
    minus: UInt64[np.ndarray, "r words"],
    facet_label: Int[np.ndarray, " F"],
    facet_count: Int[np.ndarray, " F"],
    effort: tuple[int, int],
) -> Completeness:
    """Raise SoundnessError unless the regions cover the domain with disjoint interiors.

    plus, minus: bit words (r, words), neurons positive / negative at some vertex of the region.
    facet_label (F,): >= 0 for a neuron, < 0 for a domain row; facet_count (F,): regions it bounds.
    effort: (n_signs, n_exact).
    """
    total = math.fsum(volumes)
    euler = sum(faces[::2]) - sum(faces[1::2])
    proof = Completeness(total, float(domain_volume), euler, tuple(faces), *effort)
    on_both_sides = (plus & minus).any(axis=1)
    if on_both_sides.any():
        _refuse(f"{int(on_both_sides.sum())} regions have vertices on both sides of a neuron")
    if not _all_distinct(plus):
        _refuse("two regions have the same activation pattern")
    wrong = facet_count != np.where(facet_label >= 0, 2, 1)
    if wrong.any():
        _refuse(f"{int(wrong.sum())} facets do not have one region on each side")
    if proof.euler != 1:
        _refuse(f"the Euler characteristic of its faces {proof.faces} is {proof.euler}, not 1")
    if not proof.gap <= VOLUME_RELATIVE:
        _refuse(
            f"the volumes of its {len(volumes)} regions sum to {proof.volume!r}, the domain has "
            f"{proof.domain_volume!r}"
        )
    return proof


def recheck_signs(
    net: ReLUNetwork,
    points: Float[np.ndarray, "V n"],
    point_error: Float[np.ndarray, "V n"],
    plus: UInt64[np.ndarray, "V words"],
    minus: UInt64[np.ndarray, "V words"],
    first: int,
) -> None:
    """Raise SoundnessError if a recorded sign contradicts the network.

    points, point_error: (V, n) vertices and bounds on their distance to the exact ones. plus,
    minus: (V, words) bits, the neurons from column `first` on; where neither is set the
    pre-activation is said to be 0. Forward error as in [T10].
    """
    n_columns = first + sum(net.hidden)
    for rows in slices(len(points), CHUNK):
        is_plus, is_minus = (unpack(words[rows], n_columns)[:, first:] for words in (plus, minus))
        gradient = np.eye(net.n_in)
        done = 0
        for W, z, error in forward(net, points[rows]):
            layer = slice(done, done + len(W))
            gradient = np.abs(W) @ gradient * SAFETY
            slack = point_error[rows] @ (gradient.T * SAFETY) + error
            wrong = ((z > slack) & ~is_plus[:, layer]) | ((z < -slack) & ~is_minus[:, layer])
            if wrong.any():
                vertex, neuron = np.argwhere(wrong)[0]
                _refuse(
                    f"the sign of neuron {done + neuron} at vertex {points[rows][vertex]} is "
                    f"recorded wrongly ({int(wrong.sum())} such)"
                )
            done = layer.stop


def _all_distinct(words: np.ndarray) -> bool:
    """Rows are pairwise different: hashes without collision prove it, else rows are compared."""
    key = np.sort(hash_words(words))
    return not (key[1:] == key[:-1]).any() or len(np.unique(words, axis=0)) == len(words)


def _refuse(why: str) -> None:
    raise SoundnessError(
        f"region table: not complete, {why}. Nothing may be certified from it; please report the "
        "network."
    )
