"""Branch and bound over (z, k): every box is decided, with a reason for the checker to follow, or
split. [T15, T16, T30, T36]
"""

import heapq
import itertools
import logging
from collections.abc import Callable

import numpy as np

from parc_jax.proof.absence.errors import BinErrors
from parc_jax.proof.absence.examine import BOXES, Batch, Examiner
from parc_jax.proof.absence.reasons import Reasons
from parc_jax.proof.absence.tree import Node, choose_split
from parc_jax.proof.regions.domain import MAX_DIMENSION
from parc_jax.safe_set.corridors.sampling import ends_from
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import Scene

_log = logging.getLogger(__name__)
TRIED = 16  # plans per open box that are tried, since one safe plan ends the search for a proof


class BranchAndBound:
    """One branch and bound, which a safe plan ends.

    root: the tree. leaves: decided and open boxes. safe_plan: (p0, k) that is safe: no proof then.
    """

    def __init__(self, scene: Scene, root: Node):
        self.model = model = scene.model
        self.scene = scene
        self.root = root
        errors = BinErrors(model.tube, np.asarray(scene.goal_A))
        self.examiner = Examiner(scene, errors)
        self.reasons = Reasons(scene, errors)
        self.spread = _spread(len(root.lo))
        # of bounds over a box for the checker, in evaluations of the network, about: each neuron is
        # followed back from both sides
        sizes = np.array([W.size for W in model.net.weights])
        before = np.cumsum([0, *sizes[:-1]])
        products = 2 * (np.array([len(W) for W in model.net.weights[:-1]]) * before[:-1]).sum()
        self.cost_of_bounds = 1 + int(products / sizes.sum())
        # what the steps change
        self._order = itertools.count()
        self._waiting: list[tuple[float, int, Node]] = []
        self._wait([root])
        self.leaves = 1
        self.exact_vertices = 0  # that the checker will have to evaluate, about
        self.safe_plan: tuple[np.ndarray, np.ndarray] | None = None

    def compile(self) -> None:
        """Compile for scenes of this size, so that a budget is spent on searching."""
        middle = ((self.root.lo + self.root.hi) / 2)[None]
        z, k = middle[:, : self.model.n_p], middle[:, self.model.n_p :]
        root = Node(self.root.lo, self.root.hi, k)
        self.examiner.by_bounds([root])
        if self.model.n_k <= MAX_DIMENSION:
            list(self.examiner.at_vertices([root]))
        verdicts(self.scene, z - ends_from(0.0, self.model, k), k)

    def run(self, until: Callable[[int], bool], max_leaves: int) -> None:
        """Decide the largest boxes first until none is left, `until()` says stop, or there are
        max_leaves. Those without a reason are split, and their halves wait.
        """
        while not (self.decided or self.leaves >= max_leaves or until(self.exact_vertices)):
            _log.info("proof of no plan: %d boxes, %d open", self.leaves, len(self._waiting))
            n = min(BOXES, len(self._waiting))
            children = self._decide([heapq.heappop(self._waiting)[2] for _ in range(n)])
            self.leaves += len(children) // 2
            self._wait(children)

    @property
    def decided(self) -> bool:
        """No box waits, or a safe plan is in hand: there is no proof then."""
        return not self._waiting or self.safe_plan is not None

    def _wait(self, nodes: list[Node]) -> None:
        """More open boxes: the largest is decided first, of equal ones the first that came."""
        for node in nodes:
            heapq.heappush(self._waiting, (-float(node.volume), next(self._order), node))

    def _decide(self, nodes: list[Node]) -> list[Node]:
        """Write down reasons; returns the children of the boxes without one.

        Bounds are tried first, which are cheap to check, and vertices where they fail.
        """
        few = self.examiner.has_few_vertices
        batches = [self.examiner.by_bounds(nodes)]
        self._write(batches[0])
        self._try_plans([node for node in nodes if node.leaf is None])
        open_and_few = [node for node in nodes if node.leaf is None and few(node)]
        for batch in self.examiner.at_vertices(open_and_few):
            self._write(batch)
            batches.append(batch)
        # what vertices say of a box is nearer to the truth
        return [child for batch in reversed(batches) for child in self._split(batch)]

    def _write(self, batch: Batch) -> None:
        cost = self.cost_of_bounds
        for i, node in enumerate(batch.nodes):
            node.leaf = self.reasons.of(batch, i)
            if node.leaf is not None:
                self.exact_vertices += cost if batch.bounded else len(node.vertices)

    def _split(self, batch: Batch) -> list[Node]:
        """Children of the boxes that are open and not split."""
        children: list[Node] = []
        seen = batch.seen
        for i, node in enumerate(batch.nodes):
            if node.leaf is None and node.split is None:
                margins = np.concatenate([seen.goal[i], seen.start[i], seen.hit[i]])
                at = choose_split(node, margins, seen.effects[i], self.model.tube)
                children += node.cut(*at, self.model.n_p)
        return children

    def _try_plans(self, nodes: list[Node]) -> None:
        """Judge some plans of each open box: a safe one ends the search, there is no proof then."""
        if not nodes:
            return
        n_p = self.model.n_p
        lo = np.array([node.lo for node in nodes])
        hi = np.array([node.hi for node in nodes])
        tried = (lo[:, None] + self.spread * (hi - lo)[:, None]).reshape(-1, lo.shape[1])
        k = tried[:, n_p:]
        p0 = tried[:, :n_p] - ends_from(0.0, self.model, k)
        safe = verdicts(self.scene, p0, k).safe
        if safe.any():
            self.safe_plan = (p0[safe][0], k[safe][0])


def _spread(n: int) -> np.ndarray:
    """Points (TRIED, n) well spread over the unit cube, the middle first (additive recurrence)."""
    root = 2.0
    for _ in range(50):
        root = (1 + root) ** (1 / (n + 1))  # of x^(n + 1) = x + 1
    return (0.5 + np.arange(TRIED)[:, None] / root ** np.arange(1, n + 1)) % 1
