"""Boxes examined together: each is told what it is told alone."""

import numpy as np
import pytest
from toy_models import toy_case

from parc_jax.proof.absence.errors import BinErrors
from parc_jax.proof.absence.examine import Examiner
from parc_jax.proof.absence.tree import Node
from parc_jax.safe_set.verdict.scene import scene_of

MARGINS = ("goal", "start", "hit")


@pytest.fixture(scope="module")
def examiner():
    model, problem = toy_case(4)
    scene = scene_of(problem, model)
    return Examiner(scene, BinErrors(model.tube, np.asarray(scene.goal_A)))


def quarters(examiner):
    """Four boxes over the goal's box and quarters of K."""
    scene, domain = examiner.scene, examiner.model.domain
    middle = (domain.lo + domain.hi) / 2
    k_lo = [domain.lo, [middle[0], domain.lo[1]], [domain.lo[0], middle[1]], middle]
    return [
        Node(
            np.concatenate([scene.z_lo, lo]), np.concatenate([scene.z_hi, lo + middle - domain.lo])
        )
        for lo in np.array(k_lo)
    ]


def of_each(batch):
    """What is said of every node, and the places at its own rows."""
    seen = batch.seen
    return [
        ([getattr(seen, name)[i] for name in MARGINS], seen.at[batch.owner == i])
        for i in range(len(batch.nodes))
    ]


def same(found, alone):
    for one, other in zip(found, alone, strict=True):
        for a, b in zip(one[0], other[0], strict=True):
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-9)
        np.testing.assert_allclose(one[1], other[1], rtol=0, atol=1e-9)


@pytest.mark.slow
def test_by_bounds_boxes_do_not_know_their_neighbours(examiner):
    nodes = quarters(examiner)
    alone = [of_each(examiner.by_bounds([node]))[0] for node in nodes]
    same(of_each(examiner.by_bounds(nodes)), alone)


@pytest.mark.slow
def test_at_vertices_boxes_do_not_know_their_neighbours(examiner):
    nodes = quarters(examiner)
    assert all(examiner.has_few_vertices(node) for node in nodes)
    assert len({len(node.vertices) for node in nodes}) > 1
    alone = [of_each(next(examiner.at_vertices([node])))[0] for node in nodes]
    same([one for batch in examiner.at_vertices(nodes) for one in of_each(batch)], alone)
