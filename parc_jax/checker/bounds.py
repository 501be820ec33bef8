"""Lower bounds of what a network says over a box of k, for all of its cells at once. [T36]

From the first layer to the last, each neuron's input x is known to lie in a range [lo, hi]. There
max(x, 0) lies above a line through the origin and below one that is no lower at lo and hi. A row of
outputs is followed back through these lines to k, whose box is known.
"""

from .exact import dot, integers

LINE_BITS = 40  # slopes and heights of the upper lines are rounded up to so many binary digits


class OverBox:
    """Bounds over boxes of k. The last box's lines are kept: neighbouring leaves often share it."""

    def __init__(self, context):
        self.context = context
        self.box = None
        self.lo = []
        self.hi = []
        self.scale = 1
        self.lines = []

    def enter(self, lo, hi):
        """The box that is meant from now on."""
        if self.box == (lo, hi):
            return
        self.box = (lo, hi)
        ends, self.scale = integers([*lo, *hi])
        self.lo = ends[: len(lo)]
        self.hi = ends[len(lo) :]
        self.lines = []
        for W, bias, _ in self.context.layers[:-1]:
            found = []
            for row, b in zip(W, bias, strict=True):
                least, scale = self._least(row, b)
                less, _ = self._least([-x for x in row], -b)
                found.append(line(least, -less, scale))
            self.lines.append(found)

    def least(self, row):
        """A lower bound (x, scale > 0) of what a row of the outputs, in integers, is: x / scale."""
        W, bias, _ = self.context.layers[-1]
        used = [(x, i) for i, x in enumerate(row) if x]
        width = len(W[0])
        self._spend(len(used) * width, row, len(self.context.layers) - 1)
        combined = [sum(x * W[i][j] for x, i in used) for j in range(width)]
        return self._least(combined, sum(x * bias[i] for x, i in used))

    def _least(self, row, constant):
        """The same of a row of the inputs to the layer after those with lines, in its units."""
        scale = self.context.layers[len(self.lines)][2]
        for depth in reversed(range(len(self.lines))):
            W, bias, q = self.context.layers[depth]
            self._spend(len(W) * (len(W[0]) + 2), row, depth)
            constant <<= LINE_BITS
            through = []
            for x, (below, above, height) in zip(row, self.lines[depth], strict=True):
                if x > 0:
                    through.append(x * below << LINE_BITS)
                else:
                    through.append(x * above)
                    constant += x * height
            constant = constant * q + dot(through, bias)
            row = [dot(through, column) for column in zip(*W, strict=True)]
            scale = (scale * q) << LINE_BITS
        self.context.spend(2 * len(row))
        total = constant * self.scale
        for x, a, b in zip(row, self.lo, self.hi, strict=True):
            total += min(x * a, x * b)
        return total, scale * self.scale

    def _spend(self, products, row, depth):
        longest = max((abs(x).bit_length() for x in row), default=0)
        self.context.spend(products, longest, self.context.layer_bits[depth])


def line(lo, hi, scale):
    """(slope below, slope above, height above) of a neuron whose input lies in [lo, hi] / scale:
    below x <= max(x, 0) and 2^LINE_BITS max(x, 0) <= above x + height, for x in it.
    """
    one = 1 << LINE_BITS
    if lo >= 0:
        return 1, one, 0
    if hi <= 0:
        return 0, 0, 0
    above = -(-(hi << LINE_BITS) // (hi - lo))
    return int(hi > -lo), above, -(above * lo // scale)
