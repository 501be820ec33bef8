"""Exact signs of pre-activations at vertices: floats where error bounds decide, else rationals."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from parc_jax.proof.regions.complex import Complex, Sign
from parc_jax.proof.regions.cut import Hyperplane
from parc_jax.proof.regions.exact import ExactNetwork, sign_of
from parc_jax.proof.regions.rounding import LayerBound, cell_gradients, layer_bound
from parc_jax.proof.regions.storage import or_over_cells, unpack

# [unit coordinates] a new vertex with a bound rho above this is computed exactly at once
POOR = 2.0**-10


class SignOracle:
    """Signs for one complex. `begin` opens a layer, then one `codes` per column in order.

    n_exact: vertices evaluated in rationals. n_signs: signs decided.
    """

    def __init__(self, lattice: Complex, exact: ExactNetwork, delta: float):
        self.lattice = lattice
        self.exact = exact
        self.delta = delta
        self.points: dict[int, tuple[list[int], int]] = {}
        self.n_exact = 0
        self.n_signs = 0

    def begin(
        self,
        weights: Sequence[np.ndarray],
        b: Float[np.ndarray, " w"],
        before: LayerBound,
        h_max: Float[np.ndarray, " inputs"],
        first_column: int,
    ) -> LayerBound:
        """Open the layer whose values the complex holds; returns its bounds.

        weights: of all layers up to it. b: its biases. before: bounds of the layer before, whose
        outputs are h_max at most. first_column: of its neurons.
        """
        lattice = self.lattice
        lattice.settle()
        done = sum(len(W) for W in weights[:-1])
        on = or_over_cells(lattice.bits.plus.view, lattice.all_rows())
        patterns = unpack(on, first_column)[:, first_column - done :]
        # by the cells of now, or of the first layer for all of them
        self.lip = cell_gradients(weights, patterns[: 1 if len(weights) == 1 else None])
        z_max = np.abs(lattice.z.view).max(axis=0)
        steepest = self.lip.max(axis=0)
        self.bound = layer_bound(weights[-1], b, before, steepest, h_max, z_max, self.delta)
        self.layer, self.W, self.b = len(weights) - 1, weights[-1], b
        self.first_column = first_column
        self.rows: dict[int, np.ndarray] = {}
        return self.bound

    def codes(self, j: int) -> tuple[np.ndarray, Hyperplane]:
        """`Sign` (V,) uint8 of neuron j of the open layer at all vertices, and its hyperplane."""
        lattice = self.lattice
        column = self.first_column + j
        z = lattice.z.view[:, j]
        threshold = self.bound.lip[j] * lattice.rho.view
        threshold += self.bound.eta[j]
        codes = Sign.PLUS << (z < 0).view(np.uint8)  # minus is the next bit; faster than where
        # by the steepest gradient of any cell first, by that of a vertex's cell where this is open
        undecided = np.flatnonzero(~(np.abs(z) > threshold))
        self.n_signs += len(z)
        if len(undecided):
            lip = self._lip(j, lattice.home[0].data[undecided])
            threshold[undecided] = self.bound.eta[j] + lip * lattice.rho.data[undecided]
            undecided = undecided[~(np.abs(z[undecided]) > threshold[undecided])]
            codes[undecided] = self._decide(undecided, j)
        plane = Hyperplane(
            column=column,
            z_column=j,
            eta=self.bound.eta[j],
            lip=lambda home: self._lip(j, home),
            delta=self.delta,
            threshold=threshold,
            repair=lambda new: self._repair(new, column + 1),
        )
        return codes, plane

    def _lip(self, j: int, home: Int[np.ndarray, " v"]) -> np.ndarray | float:
        return self.lip[home, j] if len(self.lip) > 1 else self.lip[0, j]

    def _decide(self, vertices: Int[np.ndarray, " v"], j: int) -> np.ndarray:
        if not self.W[j].any():
            return np.full(len(vertices), sign_of(self.b[j]))
        return np.array([self._row(int(v), self.first_column + j)[j] for v in vertices], np.uint8)

    def _repair(self, new: Int[np.ndarray, " v"], n_columns: int) -> None:
        for v in new[~(self.lattice.rho.data[new] <= POOR)]:
            self._row(int(v), n_columns)

    def _row(self, v: int, n_columns: int) -> np.ndarray:
        """Exact codes of the layer at vertex v; its floats are replaced by rounded exact ones."""
        if v in self.rows:
            return self.rows[v]
        n_rows = len(self.exact.rows)
        plus, zero = self.lattice.bits.at(v, n_columns)
        on, zero = np.zeros(self.exact.first_neuron[-1], bool), np.flatnonzero(zero)
        on[: n_columns - n_rows] = plus[n_rows:]  # neurons that are plus at v
        if v not in self.points:
            self.n_exact += 1
            self.points[v] = self.exact.vertex(
                zero[zero < n_rows], zero[zero >= n_rows] - n_rows, on
            )
        point, q = self.points[v]
        values, scale = self.exact.values(self.layer, point, q, on)
        lattice = self.lattice
        lattice.x.data[v] = [x / q for x in point]
        lattice.z.data[v] = [z / scale for z in values]
        lattice.rho.data[v] = 2.0**-52 * lattice.n
        self.rows[v] = np.array([sign_of(z) for z in values], np.uint8)
        return self.rows[v]
