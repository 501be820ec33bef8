"""Boxes over (z, k) as a binary tree: where a box is split, and how the tree is written."""

import math
from fractions import Fraction

import numpy as np
from jaxtyping import Float

from parc_jax.common.spelling import hex_text
from parc_jax.learning.bound.tube import Tube

# a side of k is split before one of z of equal effect: boxes that share k share their proof's cells
K_FIRST = 2.0


class Node:
    """A box lo, hi (n_p + n_k,) with the vertices of the network's cells in its box of k; open
    until it is decided.

    leaf: (reason, its entries) of a decided box. split: (axis, value, lower child, upper child).
    """

    def __init__(self, lo: np.ndarray, hi: np.ndarray, vertices: np.ndarray | None = None):
        self.lo = lo
        self.hi = hi
        self.vertices = vertices
        self.leaf: tuple[str, object] | None = None
        self.split: tuple[int, float, Node, Node] | None = None

    @property
    def volume(self) -> Fraction:
        """Exact volume of the box [units of z and k multiplied]."""
        sides = zip(self.lo, self.hi, strict=True)
        return math.prod((Fraction(b) - Fraction(a) for a, b in sides), start=Fraction(1))

    def cut(self, axis: int, value: float, n_p: int) -> tuple["Node", "Node"]:
        """Split at a value strictly inside; returns the lower and the upper child."""
        same = self.vertices if axis < n_p else None
        below = Node(self.lo, self.hi.copy(), same)
        above = Node(self.lo.copy(), self.hi, same)
        below.hi[axis] = above.lo[axis] = value
        self.split = (axis, value, below, above)
        return below, above

    def walk(self):
        """All nodes below and including this one, depth first, lower parts first."""
        stack = [self]
        while stack:
            node = stack.pop()
            yield node
            if node.split is not None:
                stack += node.split[:1:-1]

    def spell(self) -> list[dict]:
        """The certificate's flat tree."""
        return [node._spell() for node in self.walk()]

    def _spell(self) -> dict:
        if self.split is not None:
            return {"split": [self.split[0], hex_text(self.split[1])]}
        return {"open": None} if self.leaf is None else {self.leaf[0]: self.leaf[1]}


def choose_split(
    node: Node, margins: Float[np.ndarray, " r"], effects: Float[np.ndarray, "r n"], tube: Tube
) -> tuple[int, float]:
    """Axis and value. margins, effects: of the reasons, as in `Examined`.

    The reason that should hold on the largest share of the box, about its middle, decides, of none
    the nearest by the effects of the sides: to be near in a few sides is cheap, in many it is not.
    Its strongest side is split: at the middle, or at the edge between bins nearest to it.
    """
    total = effects.sum(axis=1)
    ratio = np.where(total > 0, -margins / np.where(total > 0, total, 1), np.inf)
    sides = total**2 / np.maximum((effects**2).sum(axis=1), np.finfo(float).tiny)  # that matter
    share = np.clip(1 - 2 * ratio, 0, 1) ** np.maximum(sides, 1)
    reason = int(np.lexsort((ratio, -share))[0])
    weight = effects[reason] if np.isfinite(ratio[reason]) else node.hi - node.lo
    weight = weight * np.where(np.arange(len(weight)) < tube.n_p, 1.0, K_FIRST)
    for axis in np.argsort(-weight):
        middle = _middle(node, int(axis), tube)
        if node.lo[axis] < middle < node.hi[axis]:
            return int(axis), middle
    raise ArithmeticError("a box has become too small to split")


def _middle(node: Node, axis: int, tube: Tube) -> float:
    middle = float((node.lo[axis] + node.hi[axis]) / 2)
    if axis >= tube.n_p:
        edge = tube.edges[axis - tube.n_p]
        inside = edge[(edge > node.lo[axis]) & (edge < node.hi[axis])]
        if len(inside):
            return float(inside[np.argmin(np.abs(inside - middle))])
    return middle
