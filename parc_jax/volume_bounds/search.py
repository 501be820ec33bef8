"""Branch and bound over (z, k): every box is decided, with a reason for the checker to follow, or
split. [T15, T16, T30, T36]
"""

import heapq
import itertools
import math
from fractions import Fraction
from typing import NamedTuple

import jax
import numpy as np

from parc_jax.arrays import x64
from parc_jax.body import numbered
from parc_jax.certificate.write import one_point
from parc_jax.errors import BudgetError
from parc_jax.model import TrajectoryModel
from parc_jax.network.predict import outputs
from parc_jax.pwa.domain import MAX_DIMENSION
from parc_jax.pwa.subdivide import enumerate_regions
from parc_jax.sets.box import Box
from parc_jax.spelling import fraction_text
from parc_jax.tolerances import TOLERANCES
from parc_jax.verdict.pointwise import verdicts
from parc_jax.verdict.scene import Scene
from parc_jax.volume_bounds.bin_errors import OverBins, as_template, bin_errors
from parc_jax.volume_bounds.bounds import Boxes, Examined, examine_by_bounds_jit, examine_jit
from parc_jax.volume_bounds.contact_margins import SHARES
from parc_jax.volume_bounds.contacts import Contacts, short_weights
from parc_jax.volume_bounds.faces import goal_entry
from parc_jax.volume_bounds.safe_boxes import SafeBoxes
from parc_jax.volume_bounds.tree import Node, choose_split

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


class Batch(NamedTuple):
    """Boxes that were examined in one call.

    over: the bins that each overlaps. owner: (m,) number of the box that a row of `seen.at` is
    about. bounded: whether the network was known by bounds, and not by the vertices of its cells.
    """

    nodes: list[Node]
    over: list[OverBins]
    seen: Examined
    owner: np.ndarray
    bounded: bool


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
        self.errors = bin_errors(model.tube, np.asarray(scene.goal_A))
        problem = scene.problem
        self.contacts = [
            Contacts(problem, o, part)
            for o in range(len(problem.obstacles))
            for part in range(len(problem.parts))
        ]
        self.parts = numbered(problem.body, model.points)
        self.goal_rows = len(problem.goal.b)
        self.start_rows = 0 if problem.start is None else len(problem.start.b)
        self.safe_boxes = SafeBoxes(model, scene, self.errors) if bounds else None
        self.spread = _spread(len(root.lo))
        self.cost_of_bounds = _cost_of_bounds(model.net)
        # what the steps change
        self.waiting = OpenBoxes(root)
        self.leaves = 1
        self.exact_vertices = 0  # that the checker will have to evaluate, about
        self.safe_plan: tuple[np.ndarray, np.ndarray] | None = None

    def compile(self) -> None:
        """Compile for scenes of this size, so that a budget is spent on searching."""
        middle = ((self.root.lo + self.root.hi) / 2)[None]
        z, k = middle[:, : self.model.n_p], middle[:, self.model.n_p :]
        root = Node(self.root.lo, self.root.hi, k)
        self._by_bounds([root])
        if self.model.n_k <= MAX_DIMENSION:
            self._at_vertices([root])
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
        """Decide the largest boxes; those without a reason are split and wait."""
        nodes = [self.waiting.take() for _ in range(min(BOXES, len(self.waiting)))]
        children = self._decide(nodes)
        self.leaves += len(children) // 2
        for node in children:
            self.waiting.add(node)

    def _decide(self, nodes: list[Node]) -> list[Node]:
        """Write down the reasons that are found; the children of the boxes without one.

        A proof that no plan exists tries bounds first, which are cheap to check, and vertices where
        they fail. Volume bounds take vertices at once where there are few: a box that may be safe
        needs them anyway.
        """
        by_bounds = [n for n in nodes if not self.bounds or self._count(n) > VERTICES]
        batches = []
        if by_bounds:
            batches.append(self._by_bounds(by_bounds))
            self._write_unsafe(batches[0])
        if not self.bounds:
            self._try_plans([node for node in nodes if node.leaf is None])
        few = [node for node in nodes if node.leaf is None and self._count(node) <= VERTICES]
        for some in _fitting(few):
            batch = self._at_vertices(some)
            self._write_unsafe(batch)
            if self.bounds:
                self._write_safe(batch)
            batches.append(batch)
        children: list[Node] = []
        for batch in reversed(batches):  # what vertices say of a box is nearer to the truth
            children += self._split(batch)
        return children

    def _count(self, node: Node) -> int:
        """How many vertices the cells in a box have; more than VERTICES for too many."""
        if node.vertices is None:
            if self.model.n_k > MAX_DIMENSION or self._cells_at_first(node) > VERTICES:
                return VERTICES + 1
            k_box = Box(node.lo[self.model.n_p :], node.hi[self.model.n_p :])
            try:
                regions = enumerate_regions(self.model.net, k_box, max_regions=2 * VERTICES)
            except BudgetError:
                return VERTICES + 1
            node.vertices = regions.points
        return len(node.vertices)

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

    def _write_unsafe(self, batch: Batch) -> None:
        cost = self.cost_of_bounds
        for i, node in enumerate(batch.nodes):
            node.leaf = self._unsafe(batch, i)
            if node.leaf is not None:
                self.exact_vertices += cost if batch.bounded else len(node.vertices)

    def _write_safe(self, batch: Batch) -> None:
        for i, node in enumerate(batch.nodes):
            if node.leaf is None:
                node.leaf = self._safe(batch, i)
                if node.leaf is not None:
                    self.exact_vertices += SAFE_COST * len(node.vertices)

    def _split(self, batch: Batch) -> list[Node]:
        """Children of the boxes that are open and not split."""
        children: list[Node] = []
        seen = batch.seen
        for i, node in enumerate(batch.nodes):
            if node.leaf is None and node.split is None:
                margins = np.concatenate([seen.goal[i], seen.start[i], seen.hit[i]])
                tube, n_p = self.model.tube, self.model.n_p
                at = choose_split(node, margins, seen.effects[i], seen.slopes[i], tube, n_p)
                children += node.cut(*at, n_p)
        return children

    def _at_vertices(self, nodes: list[Node]) -> Batch:
        """Boxes examined at the vertices of their cells, padded to one compiled shape."""
        k = np.concatenate([node.vertices for node in nodes])
        owner = np.repeat(np.arange(len(nodes)), [len(node.vertices) for node in nodes])
        missing = VERTICES - len(k)
        k = np.concatenate([k, np.repeat(k[:1], missing, axis=0)])
        owner = np.concatenate([owner, np.full(missing, BOXES)])
        boxes, over = self._as_boxes(nodes)
        with x64():
            seen = examine_jit(self.model.net, self.scene.arrays, k, owner, boxes)
            return Batch(nodes, over, Examined(*jax.device_get(seen)), owner, bounded=False)

    def _by_bounds(self, nodes: list[Node]) -> Batch:
        """Boxes examined by bounds of the network."""
        boxes, over = self._as_boxes(nodes)
        owner = np.repeat(np.arange(BOXES), 2**self.model.n_p)
        with x64():
            seen = examine_by_bounds_jit(self.model.net, self.scene.arrays, boxes)
            return Batch(nodes, over, Examined(*jax.device_get(seen)), owner, bounded=True)

    def _as_boxes(self, nodes: list[Node]) -> tuple[Boxes, list[OverBins]]:
        """Boxes, padded to one compiled shape, and the bins that each of the nodes overlaps."""
        n_p = self.model.n_p
        over = [self.errors.over(node.lo[n_p:], node.hi[n_p:]) for node in nodes]
        rows = np.minimum(np.arange(BOXES), len(nodes) - 1)
        templates = self.model.tube.templates
        common = [each.common for each in over]
        if templates is not None:
            n_bases = templates.interval.errors.half.shape[-2]
            common = [as_template(errors, n_bases) for errors in common]
        boxes = Boxes(
            np.array([node.lo for node in nodes])[rows],
            np.array([node.hi for node in nodes])[rows],
            jax.tree.map(lambda *of_box: np.array(of_box)[rows], *common),
            *(
                np.array([getattr(each, name) for each in over])[rows]
                for name in ("blur", "goal_least", "goal_most", "straddles")
            ),
        )
        return boxes, over

    def _unsafe(self, batch: Batch, i: int):
        """(reason, what) of one box, the cheapest to check first, or None."""
        found = self._reason(batch, i)
        if found is None or not batch.bounded or (found[0] == "goal" and self._about_z(found[1])):
            return found
        return "bounded", dict([found])

    def _about_z(self, entries: list) -> bool:
        """Whether the rows of the goal that a leaf names are about z alone: no bound is asked."""
        A = self.scene.problem.goal.A[:, self.model.n_p :]
        return not A[[row for row, *_ in entries]].any()

    def _reason(self, batch: Batch, i: int):
        """The reason of one box and what it names, or None."""
        margin = TOLERANCES.leaf_margin
        seen = batch.seen
        for reason, margins in (
            ("goal", seen.goal[i, : self.goal_rows]),
            ("start", seen.start[i, : self.start_rows]),
        ):
            if len(margins) and margins.max() > margin:
                row = int(np.argmax(margins))
                if reason == "start":
                    return reason, [[row, "1"]]
                errors = self.errors.at_end(batch.over[i].bins)
                return reason, [goal_entry(self.errors, errors, row, Fraction(1))]
        for c in np.flatnonzero(seen.hit[i] > margin):
            what = self._hit(batch, i, c)
            if what is not None:
                return "hit", what
        return None

    def _hit(self, batch: Batch, i: int, c: int):
        """What a certificate says of contact c of one box, or None where it cannot be written."""
        pair, t, share = batch.seen.which[i, c].tolist()
        at = batch.seen.at[batch.owner == i, c]
        over = batch.over[i]
        corners = _corners(batch.nodes[i], self.model.n_p)
        contacts = self.contacts[pair]
        moment = [t, str(Fraction(SHARES[share]))]
        # by bounds one contact serves all that a corner has; else each vertex may have its own
        most = 1 if batch.bounded else None
        if one_point(self.scene.problem, self.model.tube):
            places = corners[:, None] + at[None, :, 0]
            if not batch.bounded:
                places = places.reshape(1, -1, self.model.n_p)
            entries = []
            errors = self.errors.of_contact(over, t, [0], np.ones(1))
            for served in places:
                found = contacts.find(served, errors, most)
                if found is None:
                    return None
                alone = [[body, error] for body, (error,) in found]
                entries += [entry for entry in alone if entry not in entries]
            return [pair, *moment, entries]
        points = list(self.parts[pair % len(self.parts)].points)
        at = at[:, points]
        groups = []
        for corner, given in zip(corners, batch.seen.weights[i, c][:, points], strict=True):
            weights = short_weights(given)
            mixed = np.array([float(w) for w in weights])
            errors = self.errors.of_contact(over, t, points, mixed)
            entries = contacts.find(corner + mixed @ at, errors, most)
            if entries is None:
                return None
            groups.append([fraction_text(weights), entries])
        unique = [group for g, group in enumerate(groups) if group not in groups[:g]]
        return [*divmod(pair, len(self.parts)), *moment, unique]

    def _safe(self, batch: Batch, i: int):
        """("safe", separation) of one box, or None."""
        seen = batch.seen
        if not (seen.fits[i] > TOLERANCES.leaf_margin and seen.gap[i] > 0):
            return None
        node = batch.nodes[i]
        runs = self.safe_boxes.separation(node, batch.over[i].bins, node.vertices)
        return None if runs is None else ("safe", runs)

    def _try_plans(self, nodes: list[Node]) -> None:
        """Some plans of each open box: one that is safe is kept, since no proof gets around it."""
        if not nodes:
            return
        n_p = self.model.n_p
        lo = np.array([node.lo for node in nodes])
        hi = np.array([node.hi for node in nodes])
        tried = (lo[:, None] + self.spread * (hi - lo)[:, None]).reshape(-1, lo.shape[1])
        k = tried[:, n_p:]
        p0 = tried[:, :n_p] - ends(self.model, k)
        safe = verdicts(self.model, self.scene, p0, k).safe
        if safe.any():
            self.safe_plan = (p0[safe][0], k[safe][0])


def _fitting(nodes: list[Node]):
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


def _cost_of_bounds(net) -> int:
    """Of bounds over a box for the checker, in evaluations of the network, about: each neuron is
    followed back from both sides.
    """
    sizes = np.array([W.size for W in net.weights])
    before = np.cumsum([0, *sizes[:-1]])
    products = 2 * (np.array([len(W) for W in net.weights[:-1]]) * before[:-1]).sum()
    return 1 + int(products / sizes.sum())


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
