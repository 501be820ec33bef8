"""Boxes over (z, k) examined many at a time, by vertices or bounds, in calls of one shape each."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.common.arrays import x64
from parc_jax.common.errors import BudgetError
from parc_jax.common.sets.box import Box
from parc_jax.proof.absence.errors import BinErrors, OverBins, as_template
from parc_jax.proof.absence.examine import Boxes, Examined, examine, examine_by_bounds
from parc_jax.proof.absence.tree import Node
from parc_jax.proof.regions.domain import MAX_DIMENSION
from parc_jax.proof.regions.subdivide import enumerate_regions
from parc_jax.safe_set.verdict.scene import Scene

# examined together in one compiled call
BOXES = 32
VERTICES = 512


class Batch(NamedTuple):
    """Boxes that were examined in one call.

    over: the bins that each overlaps. owner: (m,) number of the box that a row of `seen.at` is
    about. bounded: whether by bounds of the network, and not at the vertices of its cells.
    """

    nodes: list[Node]
    over: list[OverBins]
    seen: Examined
    owner: np.ndarray
    bounded: bool


class Examiner:
    """Examines boxes of one scene."""

    def __init__(self, scene: Scene, errors: BinErrors):
        self.model = scene.model
        self.scene = scene
        self.errors = errors

    def has_few_vertices(self, node: Node) -> bool:
        """Whether the cells in a box have at most VERTICES vertices, which the node then knows."""
        if node.vertices is None:
            if self.model.n_k > MAX_DIMENSION or self._cells_at_first(node) > VERTICES:
                return False
            k_box = Box(node.lo[self.model.n_p :], node.hi[self.model.n_p :])
            try:
                regions = enumerate_regions(self.model.net, k_box, max_regions=2 * VERTICES)
            except BudgetError:
                return False
            node.vertices = regions.points
        return len(node.vertices) <= VERTICES

    def _cells_at_first(self, node: Node) -> int:
        """How many cells the first layer makes in a box of k if its neurons lie in general
        position. Later layers make more, so a large number spares counting them.
        """
        n_p = self.model.n_p
        middle = (node.lo + node.hi)[n_p:] / 2
        half = (node.hi - node.lo)[n_p:] / 2
        W, b = self.model.net.weights[0], self.model.net.biases[0]
        crossing = int((np.abs(W @ middle + b) < np.abs(W) @ half).sum())
        return sum(math.comb(crossing, i) for i in range(self.model.n_k + 1))

    def at_vertices(self, nodes: list[Node]) -> Iterator[Batch]:
        """Boxes of few vertices, examined at them: as many as fit, padded to one compiled shape."""
        for some in _fitting(nodes):
            k = np.concatenate([node.vertices for node in some])
            owner = np.repeat(np.arange(len(some)), [len(node.vertices) for node in some])
            missing = VERTICES - len(k)
            k = np.concatenate([k, np.repeat(k[:1], missing, axis=0)])
            owner = np.concatenate([owner, np.full(missing, BOXES)])
            boxes, over = self._as_boxes(some)
            with x64():
                seen = examine(self.model.net, self.scene.tabled, k, owner, boxes)
                seen = Examined(*jax.device_get(seen))
            yield Batch(some, over, seen, owner, bounded=False)

    def by_bounds(self, nodes: list[Node]) -> Batch:
        """Boxes examined by bounds of the network."""
        boxes, over = self._as_boxes(nodes)
        owner = np.repeat(np.arange(BOXES), 2**self.model.n_p)
        with x64():
            seen = examine_by_bounds(self.model.net, self.scene.tabled, boxes)
            return Batch(nodes, over, Examined(*jax.device_get(seen)), owner, bounded=True)

    def _as_boxes(self, nodes: list[Node]) -> tuple[Boxes, list[OverBins]]:
        """Boxes, padded to one compiled shape, and the bins that each of the nodes overlaps."""
        n_p = self.model.n_p
        over = [self.errors.over(node.lo[n_p:], node.hi[n_p:]) for node in nodes]
        rows = np.minimum(np.arange(BOXES), len(nodes) - 1)
        # a box in one bin has its template, one in several has half widths: of one shape here
        templates = self.model.tube.templates
        alike = [each._replace(bins=None) for each in over]
        if templates is not None:
            n_bases = templates.interval.errors.half.shape[-2]
            alike = [x._replace(common=as_template(x.common, n_bases)) for x in alike]
        each = [Boxes(node.lo, node.hi, of) for node, of in zip(nodes, alike, strict=True)]
        return jax.tree.map(lambda *of_box: np.array(of_box)[rows], *each), over


def _fitting(nodes: list[Node]) -> Iterator[list[Node]]:
    """The nodes in parts whose cells have no more than VERTICES vertices together."""
    some: list[Node] = []
    used = 0
    for node in nodes:
        if used + len(node.vertices) > VERTICES:
            yield some
            some, used = [], 0
        some.append(node)
        used += len(node.vertices)
    if some:
        yield some
