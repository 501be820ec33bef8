"""The network over the integers: exact vertices and signs for the few cases that floats leave open.

Every float64 is a dyadic rational, so each layer is an integer matrix over a power of two. A vertex
is defined by the hyperplanes through it, never by its floats: its neurons of sign 0 and the domain
rows it touches. With every neuron of sign 0 taken as inactive their affine forms have full rank n
at the vertex (each face of the complex was made by a form that takes both signs on the face it
cuts, and forms depend only on signs decided earlier), so the point is a rational.
"""

from collections.abc import Sequence
from fractions import Fraction
from itertools import chain

import numpy as np
from jaxtyping import Float, Int

from parc_jax.common.errors import SoundnessError
from parc_jax.common.lp.exact import Basis
from parc_jax.common.sets.rational import whole
from parc_jax.proof.regions.complex import Sign

CACHED_FORMS = 4096  # patterns whose integer forms are kept


class ExactNetwork:
    """Integer copy of domain rows and layers. `on` is bool (n_hidden,): strictly positive neurons.

    rows: domain rows (h, n + 1) = (A, -b), scaled. layers: per layer W (out, in), b (out,) as
    integers; shifts: the power of two of all layers up to this one.
    """

    def __init__(
        self,
        A: Float[np.ndarray, "h n"],
        b: Float[np.ndarray, " h"],
        weights: Sequence[np.ndarray],
        biases: Sequence[np.ndarray],
    ):
        self.n = A.shape[1]
        self.rows, _ = _integers(np.column_stack([A, -np.asarray(b)]))
        self.layers = []
        self.shifts = []
        self.first_neuron = [0]
        total = 0
        for W, beta in zip(weights, biases, strict=True):
            table, shift = _integers(np.column_stack([W, beta]))
            total += shift
            self.layers.append((table[:, :-1], table[:, -1]))
            self.shifts.append(total)
            self.first_neuron.append(self.first_neuron[-1] + len(beta))
        self._forms: dict = {}

    def forms(self, layer: int, on: np.ndarray) -> np.ndarray:
        """Affine pre-activations of a layer under the pattern `on`: integers (w, n + 1), gradient
        then constant, times 2^shifts[layer]. Cached by the pattern of the layers before."""
        key = (layer, on[: self.first_neuron[layer]].tobytes())
        if key not in self._forms:
            if len(self._forms) >= CACHED_FORMS:
                self._forms.clear()
            W, b = self.layers[layer]
            if layer == 0:
                table = np.column_stack([W, b])
            else:
                active = self._active(layer - 1, on)
                table = np.dot(W[:, active], self.forms(layer - 1, on)[active])
                table[:, -1] += b << self.shifts[layer - 1]
            self._forms[key] = table
        return self._forms[key]

    def values(
        self, layer: int, point: list[int], q: int, on: np.ndarray
    ) -> tuple[np.ndarray, int]:
        """Pre-activations of a layer at point / q: integers (w,) and their positive denominator."""
        h = np.array(point, dtype=object)
        scale = q
        for l in range(layer + 1):
            W, b = self.layers[l]
            active = np.arange(self.n) if l == 0 else self._active(l - 1, on)
            h = b * scale + np.dot(W[:, active], h[active])  # of none active, zeros
            scale = q << self.shifts[l]
        return h, scale

    def codes(self, x: np.ndarray) -> np.ndarray:
        """`Sign` of all hidden neurons at a float point (n,): uint8 (n_hidden,)."""
        point, shift = _integers(x)
        on = np.zeros(self.first_neuron[-1], bool)
        out: list[np.uint8] = []
        for layer in range(len(self.layers)):
            values, _ = self.values(layer, list(point), 1 << shift, on)
            out.extend(sign_of(v) for v in values)
            on[self.first_neuron[layer] : self.first_neuron[layer + 1]] = [v > 0 for v in values]
        return np.array(out, np.uint8)

    def vertex(
        self,
        tight_rows: Int[np.ndarray, " tight"],
        zero_neurons: Int[np.ndarray, " zero"],
        on: np.ndarray,
    ) -> tuple[list[int], int]:
        """The point on given domain rows and zero neurons, integers in lowest terms over q > 0."""
        basis, bounds = Basis(self.n), []
        layers = np.searchsorted(self.first_neuron, zero_neurons, side="right") - 1
        neurons = zip(layers.tolist(), zero_neurons, strict=True)
        zero = (self.forms(layer, on)[i - self.first_neuron[layer]] for layer, i in neurons)
        for form in chain((self.rows[i] for i in tight_rows), zero):
            *normal, constant = map(Fraction, form)
            if basis.add(normal):
                bounds.append(-constant)
            if basis.full:
                *point, q = whole((*basis.meet(bounds), Fraction(1)))
                return point, q
        raise SoundnessError(
            f"exact vertex: its {len(tight_rows) + len(zero_neurons)} hyperplanes have rank "
            f"{len(basis)} < {self.n}. The complex is inconsistent; please report the network."
        )

    def _active(self, layer: int, on: np.ndarray) -> np.ndarray:
        return np.flatnonzero(on[self.first_neuron[layer] : self.first_neuron[layer + 1]])


def sign_of(value: int | float) -> np.uint8:
    """`Sign` of one exact number."""
    if value > 0:
        return Sign.PLUS
    return Sign.MINUS if value < 0 else Sign.ZERO


def _integers(array: np.ndarray) -> tuple[np.ndarray, int]:
    """Floats as integers over one power of two: array = integers / 2^shift."""
    ratios = [float(v).as_integer_ratio() for v in array.ravel()]
    shift = max((d.bit_length() - 1 for _, d in ratios), default=0)
    values = np.empty(array.size, dtype=object)
    values[:] = [p << (shift - d.bit_length() + 1) for p, d in ratios]
    return values.reshape(array.shape), shift
