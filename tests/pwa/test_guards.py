"""Each guard of the table, shown failing: a broken kernel or doctored evidence ends in
SoundnessError.
"""

import numpy as np
import pytest
from exact_regions import exact_regions
from region_networks import degenerate_networks, random_network, unit_box

from parc_jax.common.errors import SoundnessError
from parc_jax.common.sets.hpolytope import from_box
from parc_jax.learning.network.relu import relu_network
from parc_jax.proof.regions import assemble, cut, enumerate_regions, proof, signs, subdivide

pytestmark = pytest.mark.soundness
NET, DOMAIN = random_network(2, [6, 5], seed=3), unit_box(2)


@pytest.fixture
def evidence(monkeypatch):
    """The arguments with which a good table proves itself."""
    seen = {}

    def record(*args):
        seen["args"] = args
        return proof.prove_complete(*args)

    monkeypatch.setattr(assemble, "prove_complete", record)
    enumerate_regions(NET, DOMAIN)
    return list(seen["args"])


VOLUMES, DOMAIN_VOLUME, FACES, PLUS, MINUS, LABEL, COUNT = range(7)


def refused(args, words):
    with pytest.raises(SoundnessError, match=words):
        proof.prove_complete(*args)


def test_good_evidence_is_accepted(evidence):
    assert proof.prove_complete(*evidence).gap <= 1e-15


def test_missing_volume(evidence):
    evidence[VOLUMES] = evidence[VOLUMES] * np.append(np.ones(len(evidence[VOLUMES]) - 1), 1 - 1e-8)
    refused(evidence, "volumes of its")


def test_not_a_number(evidence):
    evidence[VOLUMES] = np.append(evidence[VOLUMES][1:], np.nan)
    refused(evidence, "volumes of its")


@pytest.mark.parametrize("k", range(3))
def test_missing_face(evidence, k):
    evidence[FACES] = [count - (i == k) for i, count in enumerate(evidence[FACES])]
    refused(evidence, "Euler")


def test_vertices_on_both_sides(evidence):
    evidence[MINUS] = evidence[MINUS].copy()
    evidence[MINUS][0] |= evidence[PLUS][0]
    refused(evidence, "both sides")


def test_same_pattern_twice(evidence):
    evidence[PLUS] = evidence[PLUS].copy()
    evidence[PLUS][1], evidence[MINUS] = evidence[PLUS][0], np.zeros_like(evidence[MINUS])
    refused(evidence, "same activation pattern")


@pytest.mark.parametrize("side", ["inner", "outer"])
def test_facet_without_its_regions(evidence, side):
    which = evidence[LABEL] >= 0 if side == "inner" else evidence[LABEL] < 0
    evidence[COUNT] = evidence[COUNT].copy()
    evidence[COUNT][np.flatnonzero(which)[0]] += 1 if side == "outer" else -1
    refused(evidence, "facets do not have")


def test_a_hash_collision_is_not_taken_for_equality(evidence, monkeypatch):
    """All rows hash alike; they still differ."""
    words = np.array([[1, 2], [2, 1]], np.uint64)
    monkeypatch.setattr(proof, "hash_words", lambda rows: np.zeros(len(rows), np.uint64))
    assert proof._all_distinct(words)
    assert not proof._all_distinct(words[[0, 0]])


def test_a_neuron_that_is_not_cut(monkeypatch):
    def forgetful(lattice, codes, plane):
        if plane.column != 7:
            cut.cut(lattice, codes, plane)

    monkeypatch.setattr(subdivide, "cut", forgetful)
    with pytest.raises(SoundnessError):
        enumerate_regions(NET, DOMAIN)


def test_an_epsilon_in_the_signs(monkeypatch):
    """|z| < 0.05 read as zero: the classical way to lose regions."""
    original = signs.SignOracle.codes

    def rounded(self, j):
        codes, slack = original(self, j)
        codes[np.abs(self.lattice.z.view[:, j]) < 0.05] = 0
        return codes, slack

    monkeypatch.setattr(signs.SignOracle, "codes", rounded)
    with pytest.raises(SoundnessError, match="recorded wrongly"):
        enumerate_regions(NET, DOMAIN)


def test_one_flipped_sign(monkeypatch):
    """A vertex clearly on one side recorded on the other, in the last layer, where no later cut
    suffers from it.
    """
    original = signs.SignOracle.codes

    def flipped(self, j):
        codes, slack = original(self, j)
        if self.first_column + j == 4 + sum(NET.hidden) - 1:
            codes[np.abs(self.lattice.z.view[:, j]).argmax()] ^= 3
        return codes, slack

    monkeypatch.setattr(signs.SignOracle, "codes", flipped)
    with pytest.raises(SoundnessError):
        enumerate_regions(NET, DOMAIN)


def test_faces_through_existing_vertices_forgotten(monkeypatch):
    """The degenerate part of the cut rule dropped."""
    empty = np.empty(0, int)
    monkeypatch.setattr(cut, "_zero_faces", lambda *args: (empty, empty))
    enumerate_regions(NET, DOMAIN)  # generic networks do not need it
    diagonals = relu_network(
        [np.array([[1.0, 1.0], [1.0, -1.0]]), np.ones((1, 2))], [np.zeros(2), np.zeros(1)]
    )
    with pytest.raises(SoundnessError, match="two points"):
        enumerate_regions(diagonals, DOMAIN)


def test_float_signs_where_the_filter_is_open(monkeypatch):
    """Without rationals, at least one degenerate family comes out wrong or is refused."""

    def guess(self, vertices, j):
        z = self.lattice.z.view[vertices, j]
        return np.where(z > 0, 1, np.where(z < 0, 2, 0)).astype(np.uint8)

    monkeypatch.setattr(signs.SignOracle, "_decide", guess)
    rows, noticed = from_box(DOMAIN), 0
    for seed in range(3):
        for _, net in degenerate_networks(2, [3, 2], seed):
            try:
                found = {
                    tuple(pattern.tolist()) for pattern in enumerate_regions(net, DOMAIN).patterns
                }
            except SoundnessError:
                noticed += 1
            else:
                noticed += found != set(exact_regions(net, rows.A, rows.b))
    assert noticed > 0


@pytest.mark.parametrize("n", [2, 3, 4])
def test_broken_volume_kernel(monkeypatch, n):
    original = assemble._wedge_table

    def without_signs(n, k):
        return [[(1.0, axis, rest) for _, axis, rest in terms] for terms in original(n, k)]

    monkeypatch.setattr(assemble, "_wedge_table", without_signs)
    with pytest.raises(SoundnessError, match="volumes"):
        enumerate_regions(random_network(n, [6, 4], seed=n), unit_box(n))


def test_locate_refuses_a_table_with_a_region_missing():
    table = enumerate_regions(NET, DOMAIN)
    largest = int(table.volumes.argmax())
    inside = table.region_vertices(largest).mean(axis=0)
    assert table.locate(inside) == largest
    keep = np.arange(table.count) != largest
    with pytest.raises(SoundnessError, match="no region contains"):
        table.replace(patterns=table.patterns[keep]).locate(inside)
