"""Examine a batch of boxes over (z, k): why every plan in one is unsafe, or how far from a proof.

A box of k is given by all vertices of the network's cells in it. Between those, with each corner of
the box of z, everything is affine, so a condition that holds at them with a margin holds on the
whole box. [T30] Where the cells are too many, bounds of the network stand in for them. [T36]
All numbers are float64 and decide only which leaf to write down; the checker derives vertices and
bounds again, exactly.

Many boxes are examined at a time, in calls of one shape each.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, Float

from parc_jax.common.arrays import HIGHEST, dot, least_over, product, x64
from parc_jax.common.errors import BudgetError
from parc_jax.common.sets.box import Box
from parc_jax.common.shapes import ManyParams, Numbers, Params, Positions
from parc_jax.learning.network.predict import Layout, by_point, layer_from_the_end, predict
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.absence.bounds import ranges_of_rows
from parc_jax.proof.absence.contact_margins import (
    Tried,
    contact_depth,
    contacts_to_try,
    corners_of,
    moments,
)
from parc_jax.proof.absence.errors import BinErrors, OverBins, as_template
from parc_jax.proof.absence.tree import Node
from parc_jax.proof.regions.domain import MAX_DIMENSION
from parc_jax.proof.regions.subdivide import enumerate_regions
from parc_jax.safe_set.verdict.scene import Scene, Tabled


class Boxes(NamedTuple):
    """A batch of n boxes lo, hi (n, n_p + n_k). over: of every box, stacked, without the bins."""

    lo: np.ndarray
    hi: np.ndarray
    over: OverBins


class Examined(NamedTuple):
    """Results for n boxes. A margin is how far a reason clears its condition: positive proves
    it (up to rounding). The reasons are g goal rows, s rows of the start set, c contacts.

    goal (n, g), start (n, s) [row units], hit (n, c) [m]: margins of the reasons for being unsafe.
    which: (n, c, 3) obstacle, interval, index into SHARES of each contact.
    weights: (n, c, 2^n_p, n_points) of its mixtures of points, one at each corner of the box of z.
    at: (m, c, n_points, n_p) p - z of every vertex of k at that moment.
    effects: (n, g + s + c, n_p + n_k) how much a reason's margin moves along each side of the box.
    """

    goal: jax.Array
    start: jax.Array
    hit: jax.Array
    which: jax.Array
    weights: jax.Array
    at: jax.Array
    effects: jax.Array


class Known(NamedTuple):
    """Bounds of the outputs in n boxes of k.

    places: (m, T + 1, n_c) of all points less z, at m vertices of cells, or at corners of boxes
        around them. owner: (m,) number of the box; n for padding.
    goal: pair of (n, g) least and most of the goal's rows but for z. start: likewise (n, s).
    blame: (n, n_k) the share of each side in how loose this is; 0 at vertices, which are exact.
    """

    places: jax.Array
    owner: jax.Array
    goal: tuple[jax.Array, jax.Array]
    start: tuple[jax.Array, jax.Array]
    blame: jax.Array


def offsets_from_end(net: ReLUNetwork, layout: Layout, k: Params):
    """p_s - z of all points and knots (T + 1, n_c) and q (n_q,) of k; z: the first point's end."""
    offsets, q, _ = predict(net, layout, k)
    z = jnp.concatenate([offsets[-1:, : layout.n_p]] * layout.n_points, axis=1)
    return offsets - z, q


@jax.jit
def examine(
    net: ReLUNetwork, scene: Tabled, k: ManyParams, owner: Numbers, boxes: Boxes
) -> Examined:
    """Vertices k of the cells, owner: number of their box, n for padding. Kernel over the batch."""
    n, T, n_c = boxes.over.blur.shape
    n_p = scene.z_lo.shape[0]
    layout = Layout(T, n_p, n_c // n_p)
    places, q = jax.vmap(lambda x: offsets_from_end(net, layout, x))(k)
    rest = jnp.concatenate([places[:, -1, n_p:], q], axis=1)
    known = Known(
        places=places,
        owner=owner,
        goal=_extremes(product(rest, scene.goal_A[:, n_p:].T), owner, n),
        start=_extremes(product(places[:, 0, :n_p], scene.start_A.T), owner, n),
        blame=jnp.zeros((n, k.shape[1])),
    )
    return _examined(net, scene, layout, known, boxes)


@jax.jit
def examine_by_bounds(net: ReLUNetwork, scene: Tabled, boxes: Boxes) -> Examined:
    """The same with bounds of the network over each box of k. [T36] Kernel over the batch.

    `at` has 2^n_p rows for each box, one box after another: corners that hold all its places.
    """
    n, T, n_c = boxes.over.blur.shape
    n_p = scene.z_lo.shape[0]
    layout = Layout(T, n_p, n_c // n_p)
    n_places = (T + 1) * n_c
    rest = slice(n_places - n_c + n_p, None)  # the ends of the other points, and q
    goal_rest = scene.goal_A[:, n_p:]
    rows, constants = (
        jnp.concatenate(
            [x[:n_places], product(goal_rest, x[rest]), product(scene.start_A, x[:n_p])]
        )
        for x in layer_from_the_end(net, layout)
    )
    layers = list(zip(net.weights[:-1], net.biases[:-1], strict=True))
    of_box = jax.vmap(lambda lo, hi: ranges_of_rows(layers, rows, constants, lo, hi))
    least, most = of_box(boxes.lo[:, n_p:], boxes.hi[:, n_p:])
    ends = np.cumsum([n_places, len(goal_rest)])
    low_places, low_goal, low_start = jnp.split(least, ends, axis=1)
    high_places, high_goal, high_start = jnp.split(most, ends, axis=1)
    # all points and moments at the same corner of their boxes: a mixture of them is in the hull too
    places = corners_of(
        low_places.reshape(n, T + 1, -1, n_p), high_places.reshape(n, T + 1, -1, n_p)
    )
    places = jnp.moveaxis(places, 3, 1).reshape(-1, T + 1, n_c)
    # lines part from the network as the square of how far the inputs of neurons go
    far = (boxes.hi - boxes.lo)[:, n_p:] * jnp.sqrt(dot(net.weights[0].T, net.weights[0].T))[None]
    known = Known(
        places=places,
        owner=jnp.repeat(jnp.arange(n), 2**n_p),
        goal=(low_goal, high_goal),
        start=(low_start, high_start),
        blame=far**2 / jnp.maximum(dot(far, far), jnp.finfo(far.dtype).tiny)[:, None],
    )
    return _examined(net, scene, layout, known, boxes)


def _examined(
    net: ReLUNetwork, scene: Tabled, layout: Layout, known: Known, boxes: Boxes
) -> Examined:
    n = len(boxes.lo)
    n_p = layout.n_p
    z_lo, z_hi = boxes.lo[:, :n_p], boxes.hi[:, :n_p]
    # all points move with z
    goal_z = by_point(scene.goal_A[:, : layout.n_c], layout.n_points).sum(axis=1)
    goal_rest = scene.goal_A[:, n_p:]
    (least_rest, most_rest), (least_p0, most_p0) = known.goal, known.start
    bound = scene.goal_b[None] - boxes.over.goal_least
    goal = least_over(goal_z, z_lo, z_hi) + least_rest - bound
    start = least_over(scene.start_A, z_lo, z_hi) + least_p0 - scene.start_b[None]

    path, moved, moved_end = _middle(net, layout, boxes)
    least_places, most_places = _extremes(known.places, known.owner, n)
    half_z = jnp.concatenate([(z_hi - z_lo) / 2] * layout.n_points, axis=1)
    half_size = (most_places - least_places) / 2 + half_z[:, None]
    tried = contacts_to_try(scene, path, half_size, boxes.over.common, z_hi - z_lo)
    at, depth = contact_depth(scene, tried, known.places, known.owner, z_lo, z_hi)
    _, worst = _extremes(depth, known.owner, n)

    z_rows, k_rows = [goal_z, scene.start_A], [goal_rest, scene.start_A]
    k_moves = [moved_end, moved[:, :, 0, :n_p]]
    effects = _effects_of_sides(z_rows, k_moves, k_rows, z_hi - z_lo, tried, moved)
    sizes = moments(most_places - least_places)
    sizes = sizes[jnp.arange(len(sizes))[:, None], tried.interval, tried.share]
    along = dot(jnp.abs(tried.way), _mixed(sizes, tried))  # how far the boxes around places go
    spans = [most_rest - least_rest, most_p0 - least_p0, along]
    loose = jnp.concatenate(spans, axis=1) - effects[:, :, n_p:].sum(axis=2)
    of_bins = _effects_of_bins(start, tried, boxes)
    of_bounds = jnp.maximum(loose, 0)[:, :, None] * known.blame[:, None]
    effects = effects.at[:, :, n_p:].add(of_bins + of_bounds)
    which = jnp.stack([tried.obstacle, tried.interval, tried.share], axis=2)
    return Examined(goal, start, -worst, which, tried.weights, at, effects)


def _extremes(x: Float[ArrayLike, " b *_"], owner: Numbers, n: int):
    """Least and most (n, ...) over the vertices of each box."""
    least = jax.ops.segment_min(x, owner, n + 1)[:n]
    most = jax.ops.segment_max(x, owner, n + 1)[:n]
    return least, most


def _middle(net: ReLUNetwork, layout: Layout, boxes: Boxes):
    """Of the plan in the middle of each box the path (n, T + 1, n_c), and as k moves from side to
    side, the changes (n, n_k, T + 1, n_c) of p - z and (n, n_k, n_c - n_p + n_q) of the end of the
    other points less z, and of q.
    """
    n_p = layout.n_p
    half_k = (boxes.hi[:, n_p:] - boxes.lo[:, n_p:]) / 2
    n_k = half_k.shape[1]
    center = (boxes.hi + boxes.lo) / 2
    steps = jnp.concatenate([jnp.zeros((1, n_k)), jnp.eye(n_k), -jnp.eye(n_k)])
    probes = center[:, None, n_p:] + steps[None] * half_k[:, None]
    back, q = jax.vmap(jax.vmap(lambda x: offsets_from_end(net, layout, x)))(probes)
    end = jnp.concatenate([back[:, :, -1, n_p:], q], axis=2)
    z = jnp.concatenate([center[:, None, :n_p]] * layout.n_points, axis=2)
    moved, moved_end = (x[:, 1 : n_k + 1] - x[:, n_k + 1 :] for x in (back, end))
    return z + back[:, 0], moved, moved_end


def _mixed(x: Float[ArrayLike, "n c *_ n_c"], tried: Tried):
    """(n, c, ..., n_p) mixed as the points of each contact are, by the mean of its weights."""
    weights = tried.weights.mean(axis=2)
    weights = weights.reshape(*weights.shape[:2], *[1] * (x.ndim - 2), weights.shape[2])
    return dot(jnp.swapaxes(by_point(x, weights.shape[-1]), -1, -2), weights)


def _effects_of_sides(
    z_rows: list[jax.Array],
    k_moves: list[jax.Array],
    k_rows: list[jax.Array],
    z_size: Positions,
    tried: Tried,
    moved: Float[ArrayLike, "n n_k knots n_c"],
):
    """|change| of goal rows, start rows and contacts along the sides: (n, g + s + c, n_p + n_k)."""
    n = len(z_size)
    along_z = [jnp.abs(A)[None] * z_size[:, None] for A in z_rows]
    along_z.append(jnp.abs(tried.way) * z_size[:, None])
    pairs = zip(k_moves, k_rows, strict=True)
    along_k = [jnp.abs(jnp.einsum("nij,rj->nri", x, A, precision=HIGHEST)) for x, A in pairs]
    moved_at = moments(moved)[jnp.arange(n)[:, None], :, tried.interval, tried.share]
    moved_at = _mixed(moved_at, tried)
    along_k.append(jnp.abs(jnp.einsum("ncij,ncj->nci", moved_at, tried.way, precision=HIGHEST)))
    parts = [jnp.concatenate([z, k], axis=2) for z, k in zip(along_z, along_k, strict=True)]
    return jnp.concatenate(parts, axis=1)


def _effects_of_bins(start: Float[ArrayLike, "n s"], tried: Tried, boxes: Boxes):
    """|change| of the reasons when the box is split at the edges of bins: (n, g + s + c, n_k)."""
    more_goal = boxes.over.goal_most - boxes.over.goal_least
    blur = boxes.over.blur[jnp.arange(len(boxes.lo))[:, None], tried.interval]
    more_hit = dot(jnp.abs(tried.way), _mixed(blur, tried))
    more = jnp.concatenate([more_goal, jnp.zeros_like(start), more_hit], axis=1)
    count = jnp.maximum(boxes.over.straddles.sum(axis=1), 1.0)
    return more[:, :, None] * (boxes.over.straddles / count[:, None])[:, None]


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
