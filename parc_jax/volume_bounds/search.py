"""Branch and bound over (z, k): every box is decided, with a reason for the checker to follow, or
split. [T15, T16, T30]
"""

import heapq
import itertools
from fractions import Fraction
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.arrays import x64
from parc_jax.body import numbered
from parc_jax.certificate.write import one_point
from parc_jax.errors import BudgetError
from parc_jax.model import TrajectoryModel
from parc_jax.network.predict import by_point, outputs
from parc_jax.pwa.subdivide import enumerate_regions
from parc_jax.sets.box import Box
from parc_jax.spelling import fraction_text
from parc_jax.tolerances import TOLERANCES
from parc_jax.verdict.pointwise import verdicts
from parc_jax.verdict.scene import Scene
from parc_jax.volume_bounds.bounds import Boxes, Examined, examine_jit
from parc_jax.volume_bounds.contact_margins import SHARES
from parc_jax.volume_bounds.contacts import Contacts, short_weights
from parc_jax.volume_bounds.safe_boxes import SafeBoxes
from parc_jax.volume_bounds.tree import Node, Widths, choose_split, longest_k

# examined together in one compiled call
BOXES = 32
VERTICES = 512
# time of the checker for a safe leaf, in unsafe ones: it checks all obstacles and intervals
SAFE_COST = 4
TRIED = 16  # plans per open box that are tried, since one safe plan ends the search for a proof


class Found(NamedTuple):
    """leaves: decided and open boxes. safe_plan: (p0, k) that is safe: there is no proof then."""

    root: Node
    leaves: int
    safe_plan: tuple[np.ndarray, np.ndarray] | None


class OpenBoxes:
    """The boxes that wait for a decision, the largest first; equal ones in the order they came."""

    def __init__(self, root: Node):
        self._heap: list[tuple[float, int, Node]] = []
        self._order = itertools.count()
        self.add(root)

    def __len__(self) -> int:
        return len(self._heap)

    def add(self, node: Node) -> None:
        """One more box."""
        heapq.heappush(self._heap, (-float(node.volume), next(self._order), node))

    @property
    def largest(self) -> Node:
        """The next box."""
        return self._heap[0][2]

    def take(self) -> Node:
        """The next box, which waits no longer."""
        return heapq.heappop(self._heap)[2]


class Search:
    """One branch and bound.

    bounds: also search for boxes in which every plan is safe, and go on after a safe plan.
    """

    def __init__(self, model: TrajectoryModel, scene: Scene, root: Node, bounds: bool):
        self.model = model
        self.scene = scene
        self.root = root
        self.bounds = bounds
        self.widths = Widths(model.tube)
        problem = scene.problem
        self.contacts = [
            Contacts(problem, o, part)
            for o in range(len(problem.obstacles))
            for part in range(len(problem.parts))
        ]
        self.parts = numbered(problem.body, model.points)
        self.goal_rows = len(problem.goal.b)
        self.start_rows = 0 if problem.start is None else len(problem.start.b)
        self.safe_boxes = SafeBoxes(model, scene) if bounds else None
        self.spread = _spread(len(root.lo))
        # what the steps change
        self.waiting = OpenBoxes(root)
        self.leaves = 1
        self.exact_vertices = 0  # that the checker will have to evaluate, about
        self.safe_plan: tuple[np.ndarray, np.ndarray] | None = None

    def compile(self) -> None:
        """Compile for scenes of this size, so that a budget is spent on searching."""
        middle = ((self.root.lo + self.root.hi) / 2)[None]
        z, k = middle[:, : self.model.n_p], middle[:, self.model.n_p :]
        self._examine(*self._as_boxes([Node(self.root.lo, self.root.hi, k)]))
        if self.safe_boxes is None:
            verdicts(self.model, self.scene, z - ends(self.model, k), k)
        else:
            self.safe_boxes.compile(k)

    def run(self, until, max_leaves: int) -> Found:
        """Decide the largest boxes first until none is left, `until()` says stop, or there are
        max_leaves.
        """
        while not self._ended(max_leaves) and not until(self.exact_vertices):
            self._step()
        return Found(self.root, self.leaves, self.safe_plan)

    def _ended(self, max_leaves: int) -> bool:
        no_proof = self.safe_plan is not None and not self.bounds
        return not self.waiting or self.leaves >= max_leaves or no_proof

    def _step(self) -> None:
        """Decide one batch; boxes without a reason are split and wait."""
        batch, children = self._take()
        if batch:
            children += self._decide(batch)
        self.leaves += len(children) // 2
        for node in children:
            self.waiting.add(node)

    def _take(self) -> tuple[list[Node], list[Node]]:
        """A batch of the largest boxes that fits one call, and the children of boxes with too many
        cells for any.
        """
        batch: list[Node] = []
        children: list[Node] = []
        used = 0
        while self.waiting and len(batch) < BOXES:
            n = self._count(self.waiting.largest)
            if n <= VERTICES and used + n > VERTICES:
                break
            node = self.waiting.take()
            if n > VERTICES:
                at = longest_k(node, self.model.tube, self.model.n_p, self.model.domain)
                children += node.cut(*at, self.model.n_p)
            else:
                batch.append(node)
                used += n
        return batch, children

    def _count(self, node: Node) -> int:
        """How many vertices the cells in a box have; more than VERTICES for too many."""
        if node.vertices is None:
            k_box = Box(node.lo[self.model.n_p :], node.hi[self.model.n_p :])
            try:
                regions = enumerate_regions(self.model.net, k_box, max_regions=2 * VERTICES)
            except BudgetError:
                return VERTICES + 1
            node.vertices = regions.points
        return len(node.vertices)

    def _decide(self, batch: list[Node]) -> list[Node]:
        """Write down the reasons that were found; the children of the boxes without one."""
        boxes, k, owner = self._as_boxes(batch)
        seen = self._examine(boxes, k, owner)
        for i, node in enumerate(batch):
            node.leaf = self._unsafe(node, boxes, seen, i, np.flatnonzero(owner == i))
        undecided = [i for i, node in enumerate(batch) if node.leaf is None]
        if self.bounds:
            for i in undecided:
                batch[i].leaf = self._safe(batch[i], boxes, seen, i, k[owner == i])
        elif undecided:
            self._try_plans([batch[i] for i in undecided])
        children: list[Node] = []
        for i, node in enumerate(batch):
            if node.leaf is None:
                children += self._split(node, seen, i)
            else:
                cost = SAFE_COST if node.leaf[0] == "safe" else 1
                self.exact_vertices += len(node.vertices) * cost
        return children

    def _split(self, node: Node, seen: Examined, i: int) -> tuple[Node, Node]:
        margins = np.concatenate([seen.goal[i], seen.start[i], seen.hit[i]])
        n_p = self.model.n_p
        axis, value = choose_split(
            node, margins, seen.effects[i], seen.slopes[i], self.model.tube, n_p
        )
        return node.cut(axis, value, n_p)

    def _examine(self, boxes: Boxes, k: np.ndarray, owner: np.ndarray) -> Examined:
        with x64():
            found = examine_jit(self.model.net, self.scene.arrays, k, owner, boxes)
            return Examined(*jax.device_get(found))

    def _as_boxes(self, batch: list[Node]) -> tuple[Boxes, np.ndarray, np.ndarray]:
        """Boxes, vertices (VERTICES, n_k) and their owners (VERTICES,), padded to one compiled
        shape.
        """
        n_p = self.model.n_p
        k = np.concatenate([node.vertices for node in batch])
        owner = np.repeat(np.arange(len(batch)), [len(node.vertices) for node in batch])
        missing = VERTICES - len(k)
        k = np.concatenate([k, np.repeat(k[:1], missing, axis=0)])
        owner = np.concatenate([owner, np.full(missing, BOXES)])
        lo = [node.lo for node in batch]
        hi = [node.hi for node in batch]
        widths = [self.widths.of(node.lo[n_p:], node.hi[n_p:]) for node in batch]
        rows = np.minimum(np.arange(BOXES), len(batch) - 1)
        columns = [lo, hi, *zip(*widths, strict=True)]
        return Boxes(*(np.array(column)[rows] for column in columns)), k, owner

    def _unsafe(self, node: Node, boxes: Boxes, seen: Examined, i: int, mine: np.ndarray):
        """(reason, what) of one box, the cheapest to check first, or None. mine: its vertices."""
        margin = TOLERANCES.leaf_margin
        for reason, margins in (
            ("goal", seen.goal[i, : self.goal_rows]),
            ("start", seen.start[i, : self.start_rows]),
        ):
            if len(margins) and margins.max() > margin:
                return reason, [[int(np.argmax(margins)), "1"]]
        for c in np.flatnonzero(seen.hit[i] > margin):
            what = self._hit(node, boxes, seen, i, c, mine)
            if what is not None:
                return "hit", what
        return None

    def _hit(self, node: Node, boxes: Boxes, seen: Examined, i: int, c: int, mine: np.ndarray):
        """What a certificate says of contact c of one box, or None where it cannot be written."""
        pair, t, share = seen.which[i, c].tolist()
        corners = _corners(node, self.model.n_p)
        contacts = self.contacts[pair]
        moment = [t, str(Fraction(SHARES[share]))]
        if one_point(self.scene.problem, self.model.tube):
            p = (seen.at[mine, c, 0][:, None] + corners[None]).reshape(-1, self.model.n_p)
            entries = contacts.find(p, boxes.least[i, t])
            return None if entries is None else [pair, *moment, entries]
        points = list(self.parts[pair % len(self.parts)].points)
        at = seen.at[mine, c][:, points]
        errors = by_point(boxes.least[i, t], self.model.n_points)[points]
        groups = []
        for corner, given in zip(corners, seen.weights[i, c][:, points], strict=True):
            weights = short_weights(given)
            mixed = np.array([float(w) for w in weights])
            entries = contacts.find_mixed(corner + mixed @ at, mixed, errors)
            if entries is None:
                return None
            groups.append([fraction_text(weights), entries])
        unique = [group for g, group in enumerate(groups) if group not in groups[:g]]
        return [*divmod(pair, len(self.parts)), *moment, unique]

    def _safe(self, node: Node, boxes: Boxes, seen: Examined, i: int, k: np.ndarray):
        """("safe", separation) of one box with cell vertices k (v, n_k), or None."""
        if not (seen.fits[i] > TOLERANCES.leaf_margin and seen.gap[i] > 0):
            return None
        runs = self.safe_boxes.separation(node, boxes, i, k)
        return None if runs is None else ("safe", runs)

    def _try_plans(self, nodes: list[Node]) -> None:
        """Some plans of each open box: one that is safe is kept, since no proof gets around it."""
        n_p = self.model.n_p
        lo = np.array([node.lo for node in nodes])
        hi = np.array([node.hi for node in nodes])
        tried = (lo[:, None] + self.spread * (hi - lo)[:, None]).reshape(-1, lo.shape[1])
        k = tried[:, n_p:]
        p0 = tried[:, :n_p] - ends(self.model, k)
        safe = verdicts(self.model, self.scene, p0, k).safe
        if safe.any():
            self.safe_plan = (p0[safe][0], k[safe][0])


def _corners(node: Node, n_p: int) -> np.ndarray:
    """Corners (2^n_p, n_p) of the box of z."""
    sides = zip(node.lo[:n_p], node.hi[:n_p], strict=True)
    return np.array(list(itertools.product(*sides)))


def ends(model: TrajectoryModel, k: np.ndarray) -> np.ndarray:
    """Predicted displacement (b, n_p) of the first point at the end, on the host."""
    first = model.layout.n_offsets - model.n_c
    return outputs(model.net, k, slice(first, first + model.n_p))


def _spread(n: int) -> np.ndarray:
    """TRIED points (TRIED, n) well spread over the unit cube, the middle first (additive
    recurrence).
    """
    root = 2.0
    for _ in range(50):
        root = (1 + root) ** (1 / (n + 1))  # of x^(n + 1) = x + 1
    return (0.5 + np.arange(TRIED)[:, None] / root ** np.arange(1, n + 1)) % 1
