"""The cells of the network in a box of k, on each of which it is affine, and its outputs at their
vertices. [T16]

A short file may ask for thousands of vertices and thousands of outputs: of each vertex the hidden
layers are kept, up to a limit, and the outputs are found anew.
"""

import itertools
import math

from .exact import integers, need

MAX_POINTS = 20_000  # vertices of cells in a leaf
MAX_KEPT = 1 << 22  # numbers of neurons at them; long ones count by their length


def network_cells(context, lo, hi):
    """Yields the cells of the network in a box of k, each as {vertex: (neurons, last hidden layer,
    its scale)}. [T16]

    A vertex is (homogeneous coordinates, bit set of the facets through it). All earlier neurons
    keep their sign on a cell, so the next neuron is affine on it. If that has both signs at the
    vertices, it splits the cell.
    """
    known = {}
    corners = []
    ends = [(0, 1) if a < b else (0,) for a, b in zip(lo, hi, strict=True)]
    for sides in itertools.product(*ends):
        point = [(lo, hi)[side][i] for i, side in enumerate(sides)]
        coordinates, scale = integers(point)
        facets = sum(1 << (2 * i + side) for i, side in enumerate(sides))
        corners.append(((*coordinates, scale), facets))
    stack = [(corners, 0)]
    kept = 0
    while stack:
        cell, first = stack.pop()
        for p, _ in cell:
            if p not in known:
                neurons, (hidden,), scale = context.hidden([p[:-1]], p[-1])
                values = [x for (x,) in neurons]
                known[p] = values, hidden, scale
                kept += sum(1 + x.bit_length() // 256 for x in values)
        need(len(known) <= MAX_POINTS, "too many cells in a leaf")
        need(kept <= MAX_KEPT, "too many neurons at the vertices of a leaf")
        context.spend(len(cell) * (context.n_neurons - first))
        for j in range(first, context.n_neurons):
            values = [known[p][0][j] for p, _ in cell]
            if min(values) < 0 < max(values):
                facet = 1 << (2 * context.n_k + j)
                stack += [(part, j + 1) for part in split(context, cell, values, facet)]
                break
        else:
            yield {p: known[p] for p, _ in cell}


def split(context, cell, values, facet):
    """The two parts of a cell where an affine function with these values at its vertices is >= 0
    and <= 0.

    New vertices are the zeros on edges between vertices of opposite signs; two vertices span an
    edge if no third lies on all facets that they share.
    """
    above = [(p, f, x) for (p, f), x in zip(cell, values, strict=True) if x > 0]
    below = [(p, f, x) for (p, f), x in zip(cell, values, strict=True) if x < 0]
    context.spend(len(above) * len(below) * len(cell))
    on = []
    for p, f, x in above:
        for q, g, y in below:
            shared = f & g
            if sum(h & shared == shared for _, h in cell) == 2:
                # values scale with the homogeneous coordinates: x q - y p is the zero between
                zero = [x * b - y * a for a, b in zip(p, q, strict=True)]
                common = math.gcd(*zero)
                on.append((tuple(v // common for v in zero), shared | facet))
    on += [(p, f | facet) for (p, f), x in zip(cell, values, strict=True) if x == 0]
    yield [(p, f) for p, f, _ in above] + on
    yield [(p, f) for p, f, _ in below] + on


class CellVertices:
    """Vertices of the cells in a box of k, as last hidden layers (values, scale). The last box is
    remembered: neighbouring leaves of a tree often share it.
    """

    def __init__(self, context):
        self.context = context
        self.box = None
        self.points = []

    def of(self, lo, hi):
        """[(values, scale)] of all vertices of all cells."""
        if self.box != (lo, hi):
            cells = network_cells(self.context, lo, hi)
            found = {p: hidden for cell in cells for p, (_, *hidden) in cell.items()}
            self.box, self.points = (lo, hi), list(found.values())
        return self.points


class Outputs:
    """The outputs y of the network at a point, y[places] / scale, from its last hidden layer: found
    when they are asked for and dropped with this, since a short file may have many of both.
    """

    def __init__(self, question, hidden, scale):
        self._question = question
        self._hidden = hidden, scale
        self._found: dict = {}
        self.scale = scale * question.layers[-1][2]

    def __getitem__(self, places):
        key = places.start, places.stop
        if key not in self._found:
            hidden, scale = self._hidden
            (self._found[key],), _ = self._question.outputs([hidden], scale, places)
        return self._found[key]
