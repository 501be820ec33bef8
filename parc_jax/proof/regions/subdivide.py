"""`enumerate_regions`: all linear regions of a ReLU network on a box by exact subdivision [T16]."""

import numpy as np

from parc_jax.common.arrays import once
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box, box
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.regions.assemble import build_table
from parc_jax.proof.regions.complex import Budget, Growable, Sign
from parc_jax.proof.regions.cut import cut
from parc_jax.proof.regions.domain import MAX_DIMENSION, UnitProblem, box_complex, unit_problem
from parc_jax.proof.regions.exact import ExactNetwork
from parc_jax.proof.regions.rounding import LayerBound, point_rounding
from parc_jax.proof.regions.signs import SignOracle
from parc_jax.proof.regions.table import RegionTable


def regions_of(model: TrajectoryModel) -> RegionTable:
    """All regions of a model's network over its K, enumerated once."""
    return once(model.net, _regions, tuple(model.domain.lo), tuple(model.domain.hi))


def _regions(net: ReLUNetwork, lo: tuple, hi: tuple) -> RegionTable:
    return enumerate_regions(net, box(np.array(lo), np.array(hi)))


def enumerate_regions(
    net: ReLUNetwork, domain: Box, *, max_regions: int = 2_000_000, max_bytes: int | None = None
) -> RegionTable:
    """All full-dimensional linear regions of `net` over `domain`, proved complete [T16, T17].

    net: ReLUNetwork with n_in = 1..6 inputs, any depth and widths.
    max_bytes: half of the machine's memory by default.
    Signs are exact (float64 with an error bound, rationals where that is not enough), so no region
    is lost or invented.
    Raises InputError for a box without interior, BudgetError when a cap would be passed,
    SoundnessError when the finished table does not prove itself complete.
    """
    if net.n_in > MAX_DIMENSION:
        raise InputError(
            f"enumerate_regions: expected at most {MAX_DIMENSION} inputs; got {net.n_in}. "
            "Corridors need no regions: `Planner.solve` takes any number."
        )
    unit = unit_problem(net, domain)
    n_columns = len(unit.b) + sum(net.hidden)  # the rows of the box, the neurons
    budget = Budget(max_regions, max_bytes, n_columns)
    lattice = box_complex(unit.lo, unit.hi, n_columns)
    exact = ExactNetwork(unit.A, unit.b, unit.weights, unit.biases)
    oracle = SignOracle(lattice, exact, point_rounding(net.n_in, n_columns))
    _cut_layers(oracle, unit, budget)
    return build_table(net, domain, unit, oracle)


def _cut_layers(oracle: SignOracle, unit: UnitProblem, budget: Budget) -> None:
    lattice = oracle.lattice
    column = len(oracle.exact.rows)
    # of the inputs themselves: exact floats with unit gradients
    bound = LayerBound(np.zeros(lattice.n), 0.0, np.ones(lattice.n))
    h = lattice.x.view
    for layer, b in enumerate(unit.biases):
        lattice.z = Growable(h @ unit.weights[layer].T + b)
        h_max = np.abs(h).max(axis=0, initial=0.0)
        bound = oracle.begin(unit.weights[: layer + 1], b, bound, h_max, column)
        for j in range(len(b)):
            codes, plane = oracle.codes(j)
            if (codes == Sign.PLUS).any() and (codes == Sign.MINUS).any():
                cut(lattice, codes, plane)
                lattice.compact()
            lattice.bits.mark(column, codes)  # after the cut, whose new vertices are zero here
            column += 1
            budget.check(lattice, column)
        # by the exact sign, not by the float's: a neuron of sign 0 feeds exactly 0 forward
        h = lattice.z.view * lattice.bits.is_plus(column - len(b), column)
