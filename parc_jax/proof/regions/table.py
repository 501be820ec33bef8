"""The regions of a network over a domain: patterns, vertices, facets; maps and rows on demand.

Which region contains a point: its exact activation pattern, looked up among those of the table.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import jax
import numpy as np

from parc_jax.common import struct
from parc_jax.common.arrays import slices
from parc_jax.common.errors import InputError, SoundnessError
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope, from_box
from parc_jax.learning.network.maps import affine_maps, facet_rows
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.regions.complex import Sign
from parc_jax.proof.regions.exact import ExactNetwork
from parc_jax.proof.regions.proof import Completeness
from parc_jax.proof.regions.rounding import forward
from parc_jax.proof.regions.storage import face_vertices, hash_words, pack

CHUNK = 1 << 13  # points treated at once, so that the working set stays in cache


class PatternIndex:
    """Lookup by pattern. Built once per table."""

    def __init__(self, net: ReLUNetwork, patterns: np.ndarray):
        self.net = net
        self.patterns = patterns
        self._words = pack(patterns)
        keys = hash_words(self._words)
        self._order = np.argsort(keys, kind="stable")
        self._sorted = keys[self._order]

    def find(self, k: np.ndarray) -> np.ndarray:
        """Region number (m,) of points k (m, n) inside the domain."""
        number = np.empty(len(k), int)
        for rows in slices(len(k), CHUNK):
            number[rows] = self._find_chunk(k[rows])
        return number

    def _find_chunk(self, k: np.ndarray) -> np.ndarray:
        on, sure = float_patterns(self.net, k)
        words = pack(on)
        at = np.searchsorted(self._sorted, hash_words(words))
        number = self._order[np.minimum(at, len(self._order) - 1)]
        # an undecided sign, or a hash collision: the slow way
        slow = np.flatnonzero(~(sure & (self._words[number] == words).all(axis=1)))
        if len(slow):
            no_rows = np.zeros((0, k.shape[1]))
            hidden = (self.net.weights[:-1], self.net.biases[:-1])
            exact = ExactNetwork(no_rows, np.zeros(0), *hidden)
            for i in slow:
                number[i] = self._closed_region(exact.codes(k[i]), k[i])
        return number

    def _closed_region(self, codes: np.ndarray, k: np.ndarray) -> int:
        """A region whose pattern agrees with all nonzero signs at k; its closure contains k."""
        nonzero = codes != Sign.ZERO
        plus = codes[nonzero] == Sign.PLUS
        fits = np.flatnonzero((self.patterns[:, nonzero] == plus).all(axis=1))
        if not len(fits):
            raise SoundnessError(
                f"locate: no region contains {k}; the table is incomplete. Please report the "
                "network."
            )
        return int(fits[0])


def float_patterns(net: ReLUNetwork, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Patterns (m, n_hidden) bool at k (m, n); whether rounding cannot change them (m,). [T10]"""
    on = [np.zeros((len(k), 0), bool)]
    sure = np.ones(len(k), bool)
    for _, z, error in forward(net, k):
        sure &= ((np.abs(z) > error) | (error == 0)).all(axis=1)
        on.append(z > 0)
    return np.concatenate(on, axis=1), sure


@struct.dataclass
class RegionTable:
    """All r regions of a network over a domain, proved complete. Made by `enumerate_regions`.

    Ragged arrays are flat with offsets: row j is flat[offsets[j] : offsets[j + 1]]. Faces of all
    dimensions are stored once, shared by the regions they bound; n-faces are the regions,
    (n-1)-faces the facets, 0-faces the points.

    net, domain: the network and its domain.
    patterns: (r, n_hidden) bool, active neurons; a neuron that is 0 all over a region counts as
        inactive there.
    volumes: (r,).
    points: (V, n) all vertices; point_error (V, n): proved bound on the distance to the exact ones,
        per axis.
    boundaries: per k = 1..n: the (k-1)-faces of every k-face, flat, and offsets.
    facet_label: (f,) hidden neuron whose hyperplane carries the facet, or -1 - (row of the domain).
    facet_regions: (f, 2) the regions on its two sides, -1 for outside.
    proof: Completeness.
    """

    net: ReLUNetwork
    domain: Box
    patterns: np.ndarray
    volumes: np.ndarray
    points: np.ndarray
    point_error: np.ndarray
    boundaries: tuple[tuple[np.ndarray, np.ndarray], ...]
    facet_label: np.ndarray
    facet_regions: np.ndarray
    proof: Completeness

    @property
    def count(self) -> int:
        """Number of regions r."""
        return len(self.patterns)

    @property
    def facet_index(self) -> np.ndarray:
        """Facets of the regions, flat with `facet_offsets`."""
        return self.boundaries[-1][0]

    @property
    def facet_offsets(self) -> np.ndarray:
        """Offsets (r + 1,) of all entries per facet of a region: facet_index, A, b."""
        return self.boundaries[-1][1]

    def face_vertices(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Points of all k-faces, k = 0..n, flat with offsets."""
        return face_vertices(self.boundaries, len(self.points), k)

    @cached_property
    def _region_vertices(self) -> tuple[np.ndarray, np.ndarray]:
        return self.face_vertices(self.net.n_in)

    @cached_property
    def _rows(self) -> np.ndarray:
        """Rows (A, b) of all regions, none redundant, flat with `facet_offsets`: (sum, n + 1)."""
        neuron = self.facet_label >= 0
        table = np.empty((len(neuron), self.net.n_in + 1))
        table[neuron] = facet_rows(
            self.net, self.patterns, self.facet_label[neuron], self.facet_regions[neuron, 0]
        )
        rows = from_box(self.domain)
        table[~neuron] = np.column_stack([rows.A, -rows.b])[-1 - self.facet_label[~neuron]]
        # z = g.x + c >= 0 where the neuron is active
        region = np.repeat(np.arange(self.count), np.diff(self.facet_offsets))
        label = self.facet_label[self.facet_index]
        active = label >= 0
        if self.patterns.shape[1]:
            active &= self.patterns[region, np.maximum(label, 0)]
        flat = table[self.facet_index]
        flat[active] *= -1.0
        flat[:, -1] *= -1.0
        return flat

    @property
    def A(self) -> np.ndarray:
        """Outward normals (sum, n), a row per facet, none redundant, flat with `facet_offsets`."""
        return self._rows[:, :-1]

    @property
    def b(self) -> np.ndarray:
        """Offsets of all regions, flat with `facet_offsets`: (sum,)."""
        return self._rows[:, -1]

    def _require(self, regions: Any) -> None:
        """Raises InputError but for numbers of regions and a mask; -1 is the outside, no region."""
        numbers = np.asarray(regions)
        inside = (numbers >= 0) & (numbers < self.count) if numbers.dtype.kind in "iu" else False
        mask = numbers.dtype == bool and numbers.shape == (self.count,)
        if numbers.size and not (mask or np.all(inside)):
            raise InputError(f"region: expected any of 0 to {self.count - 1}; got {regions!r:.40}.")

    def region(self, i: int) -> HPolytope:
        """Region i as {x : A x <= b}. Raises InputError."""
        self._require(i)
        rows = self._rows[self.facet_offsets[i] : self.facet_offsets[i + 1]]
        return HPolytope(rows[:, :-1], rows[:, -1])

    def region_vertices(self, i: int) -> np.ndarray:
        """Vertices (v, n) of region i; in two dimensions counterclockwise. Raises InputError."""
        self._require(i)
        index, offsets = self._region_vertices
        x = self.points[index[offsets[i] : offsets[i + 1]]]
        if x.shape[1] != 2:
            return x
        from_center = x - x.mean(axis=0)
        return x[np.argsort(np.arctan2(from_center[:, 1], from_center[:, 0]))]

    def maps(
        self, regions: int | slice | Sequence[int] | np.ndarray = slice(None)
    ) -> tuple[np.ndarray, np.ndarray]:
        """Maps C (m, n_out, n), d (m, n_out) of regions (numbers, slice or mask), all by default:
        net(k) = C k + d. Raises InputError.
        """
        if not isinstance(regions, slice):
            self._require(regions)
        return affine_maps(self.net, np.atleast_2d(self.patterns[regions]))

    @cached_property
    def _index(self) -> PatternIndex:
        return PatternIndex(self.net, self.patterns)

    def locate(self, k: Sequence[float] | np.ndarray | jax.Array) -> np.ndarray:
        """Region number of each k (..., n), on a boundary one of them, -1 outside the domain.
        Exact: k is read as the rationals its floats are. Raises InputError.
        """
        k = np.asarray(k, np.float64)
        if k.shape[-1:] != (self.net.n_in,):
            raise InputError(f"locate: expected k of {self.net.n_in} entries; got shape {k.shape}.")
        flat = k.reshape(-1, self.net.n_in)
        inside = self.domain.contains(flat)
        number = np.full(len(flat), -1)
        number[inside] = self._index.find(flat[inside])
        return number.reshape(k.shape[:-1])
