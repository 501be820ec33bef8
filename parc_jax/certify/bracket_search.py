"""Branch and bound over (z, k): every box is decided, with a reason for the checker to follow, or split. [T15, T16]"""

import heapq
import itertools
from fractions import Fraction
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.arrays import x64
from parc_jax.certify.bracket_contacts import Contacts
from parc_jax.certify.bracket_look import SHARES, Boxes, Look, look_jit
from parc_jax.certify.bracket_safe import SafeTable
from parc_jax.certify.bracket_tree import Node, Widths, choose_split, longest_k
from parc_jax.certify.evaluate import evaluate
from parc_jax.certify.scene import Scene
from parc_jax.errors import BudgetError
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid
from parc_jax.pwa.subdivide import enumerate_regions
from parc_jax.sets.box import Box
from parc_jax.tolerances import TOLERANCES

BOXES, VERTICES = 32, 512  # looked at together in one compiled call
SAFE_COST = 4  # time of the checker for a safe leaf, in unsafe ones: it looks at all obstacles and intervals
TRIED = 16  # plans per open box that are looked at in the hope that one is safe


class Found(NamedTuple):
    """leaves: decided and open boxes. safe_plan: (p0, k) that is safe after all, which ends the hope of a proof."""

    root: Node
    leaves: int
    safe_plan: tuple[np.ndarray, np.ndarray] | None


class Search:
    """One branch and bound. bracket: also look for boxes in which every plan is safe, and go on after a safe plan."""

    def __init__(self, model: TrajectoryModel, problem: ReachAvoid, scene: Scene, root: Node, bracket: bool):
        self.model, self.scene, self.root, self.bracket = model, scene, root, bracket
        self.widths = Widths(model.tube)
        self.contacts = [Contacts(problem, o) for o in range(len(problem.obstacles))]
        self.n_rows = len(problem.goal.b), 0 if problem.start is None else len(problem.start.b)
        self.safe = SafeTable(model, scene) if bracket else None
        self.safe_plan: tuple[np.ndarray, np.ndarray] | None = None
        self.spread = _spread(len(root.lo))
        self.exact_vertices = 0  # that the checker will have to evaluate, about

    def compile(self) -> None:
        """Compile for scenes of this size, so that a budget is spent on searching."""
        middle = ((self.root.lo + self.root.hi) / 2)[None, self.model.n_p :]
        self._look(*self._laid_out([Node(self.root.lo, self.root.hi, middle)]))

    def run(self, until, max_leaves: int) -> Found:
        """Decide the largest boxes first until none is left, `until()` says stop, or there are max_leaves."""
        order = itertools.count()
        heap = [(-float(self.root.volume), next(order), self.root)]
        leaves = 1
        while heap and leaves < max_leaves and not until(self.exact_vertices):
            if self.safe_plan is not None and not self.bracket:
                break
            batch, children = self._take(heap)
            children += self._decide(batch) if batch else []
            leaves += len(children) // 2
            for node in children:
                heapq.heappush(heap, (-float(node.volume), next(order), node))
        return Found(self.root, leaves, self.safe_plan)

    def _take(self, heap) -> tuple[list[Node], list[Node]]:
        """A batch of the largest boxes that fits one call, and the children of boxes with too many cells for any."""
        batch, children, used = [], [], 0
        while heap and len(batch) < BOXES:
            node = heap[0][2]
            n = self._count(node)
            if n <= VERTICES and used + n > VERTICES:
                break
            heapq.heappop(heap)
            if n > VERTICES:
                at = longest_k(node, self.model.tube, self.model.n_p, self.model.domain)
                children += node.cut(*at, self.model.n_p)
            else:
                batch.append(node)
                used += n
        return batch, children

    def _count(self, node: Node) -> int:
        if node.vertices is None:
            n = self.model.n_p
            try:
                node.vertices = enumerate_regions(
                    self.model.net, Box(node.lo[n:], node.hi[n:]), max_regions=2 * VERTICES
                ).points
            except BudgetError:
                return VERTICES + 1
        return len(node.vertices)

    def _decide(self, batch: list[Node]) -> list[Node]:
        """Write down the reasons that were found; the children of the boxes without one."""
        n_p = self.model.n_p
        boxes, k, owner = self._laid_out(batch)
        seen = self._look(boxes, k, owner)
        children = []
        for i, node in enumerate(batch):
            node.leaf = self._unsafe(node, boxes, seen, i, np.flatnonzero(owner == i))
        self._look_for_safe(batch, boxes, seen, k, owner)
        for i, node in enumerate(batch):
            if node.leaf is None:
                rooms = np.concatenate([seen.goal[i], seen.start[i], seen.hit[i]])
                at = choose_split(node, rooms, seen.effects[i], seen.slopes[i], self.model.tube, n_p)
                children += node.cut(*at, n_p)
            else:
                self.exact_vertices += len(node.vertices) * (SAFE_COST if node.leaf[0] == "safe" else 1)
        return children

    def _look(self, boxes: Boxes, k: np.ndarray, owner: np.ndarray) -> Look:
        with x64():
            return Look(*jax.device_get(look_jit(self.model.net, self.scene.arrays, k, owner, boxes)))

    def _laid_out(self, batch: list[Node]) -> tuple[Boxes, np.ndarray, np.ndarray]:
        """Boxes, vertices (VERTICES, n_k) and their owners (VERTICES,), padded to one compiled shape."""
        n_p = self.model.n_p
        k = np.concatenate([node.vertices for node in batch])
        owner = np.repeat(np.arange(len(batch)), [len(node.vertices) for node in batch])
        k, owner = (
            np.concatenate([k, np.repeat(k[:1], VERTICES - len(k), axis=0)]),
            np.concatenate([owner, np.full(VERTICES - len(owner), BOXES)]),
        )
        widths = [self.widths.of(node.lo[n_p:], node.hi[n_p:]) for node in batch]
        columns = [[node.lo for node in batch], [node.hi for node in batch], *zip(*widths, strict=True)]
        rows = np.minimum(np.arange(BOXES), len(batch) - 1)
        return Boxes(*(np.array(column)[rows] for column in columns)), k, owner

    def _unsafe(self, node: Node, boxes: Boxes, seen: Look, i: int, mine: np.ndarray):
        """(reason, what) of one box, the cheapest to check first, or None."""
        margin = TOLERANCES.leaf_margin
        for name, rooms, n in (("goal", seen.goal, self.n_rows[0]), ("start", seen.start, self.n_rows[1])):
            if n and rooms[i, :n].max() > margin:
                return name, [[int(np.argmax(rooms[i, :n])), "1"]]
        n_p = self.model.n_p
        sides = list(itertools.product((0, 1), repeat=n_p))
        corners = np.array([[(node.lo, node.hi)[side][j] for j, side in enumerate(choice)] for choice in sides])
        for c in np.flatnonzero(seen.hit[i] > margin):
            o, t, share = (int(v) for v in seen.which[i, c])
            p = (seen.at[mine, c][:, None] + corners[None]).reshape(-1, n_p)
            entries = self.contacts[o].find(p, boxes.least[i, t])
            if entries is not None:
                return "hit", [o, t, str(Fraction(SHARES[share])), entries]
        return None

    def _look_for_safe(self, batch, boxes: Boxes, seen: Look, k, owner) -> None:
        """Safe boxes, for a bracket; else a safe plan in one of the open boxes, which no proof can get around."""
        open_ = [i for i, node in enumerate(batch) if node.leaf is None]
        if self.bracket:
            for i in open_:
                if seen.fits[i] > TOLERANCES.leaf_margin and seen.gap[i] > 0:
                    if (runs := self.safe.separation(batch[i], boxes, i, k[owner == i])) is not None:
                        batch[i].leaf = ("safe", runs)
        elif open_:
            n_p = self.model.n_p
            lo, hi = np.array([batch[i].lo for i in open_]), np.array([batch[i].hi for i in open_])
            tried = (lo[:, None] + self.spread * (hi - lo)[:, None]).reshape(-1, lo.shape[1])
            z, k = tried[:, :n_p], tried[:, n_p:]
            p0 = z - ends(self.model, k)
            safe = evaluate(self.model, self.scene, p0, k).safe
            if safe.any():
                self.safe_plan = (p0[safe][0], k[safe][0])


def ends(model: TrajectoryModel, k: np.ndarray) -> np.ndarray:
    """Predicted displacement (b, n_p) at the end, on the host."""
    y = k
    for W, b in zip(model.net.weights[:-1], model.net.biases[:-1], strict=True):
        y = np.maximum(y @ W.T + b, 0)
    last = slice((model.time.n_steps - 1) * model.n_p, model.time.n_steps * model.n_p)
    return y @ model.net.weights[-1][last].T + model.net.biases[-1][last]


def _spread(n: int) -> np.ndarray:
    """TRIED points (TRIED, n) well spread over the unit cube, the middle first (additive recurrence)."""
    root = 2.0
    for _ in range(50):
        root = (1 + root) ** (1 / (n + 1))  # of x^(n + 1) = x + 1
    return (0.5 + np.arange(TRIED)[:, None] / root ** np.arange(1, n + 1)) % 1
