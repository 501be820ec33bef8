"""`enumerate_regions`: every linear region of a ReLU network over a domain, by exact subdivision
[T16].
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from parc_jax.common.arrays import once
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box, box
from parc_jax.common.sets.hpolytope import HPolytope, from_box
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.regions.assemble import build_table, domain_volume
from parc_jax.proof.regions.budget import Budget
from parc_jax.proof.regions.complex import Complex, Sign
from parc_jax.proof.regions.cut import cut
from parc_jax.proof.regions.domain import MAX_DIMENSION, box_complex, unit_problem
from parc_jax.proof.regions.exact import ExactNetwork
from parc_jax.proof.regions.prune import keep_minus
from parc_jax.proof.regions.rounding import (
    LayerBound,
    cell_gradients,
    input_bound,
    layer_bound,
    point_rounding,
)
from parc_jax.proof.regions.signs import SignOracle
from parc_jax.proof.regions.storage import or_over_cells, unpack
from parc_jax.proof.regions.table import RegionTable


def regions_of(model: TrajectoryModel) -> RegionTable:
    """All regions of a model's network over its K, enumerated once."""
    return once(model.net, _regions, tuple(model.domain.lo), tuple(model.domain.hi))


def _regions(net: ReLUNetwork, lo: tuple, hi: tuple) -> RegionTable:
    return enumerate_regions(net, box(np.array(lo), np.array(hi)))


def enumerate_regions(
    net: ReLUNetwork,
    domain: Box | HPolytope,
    *,
    max_regions: int = 2_000_000,
    max_seconds: float = 3600.0,
    max_bytes: int | None = None,
) -> RegionTable:
    """All full-dimensional linear regions of `net` over `domain`, with proof of completeness [T16,
    T17].

    net: ReLUNetwork with n_in = 1..6 inputs, any depth and widths.
    domain: Box or bounded HPolytope with interior.
    max_bytes: half of the machine's memory by default.
    Signs are exact (float64 with an error bound, rationals where that is not enough), so no region
    is lost or invented.
    Raises InputError for a domain without interior, BudgetError when a cap would be passed,
    SoundnessError when the finished table does not prove itself complete.
    """
    if net.n_in > MAX_DIMENSION:
        raise InputError(
            f"enumerate_regions: expected at most {MAX_DIMENSION} inputs; got {net.n_in}. Use "
            "march."
        )
    unit = unit_problem(net, domain)
    n = net.n_in
    is_box = isinstance(domain, Box)
    # columns: the box of the complex, the rows of a polytope, the neurons
    around = from_box(Box(unit.lo, unit.hi))
    A = around.A if is_box else np.vstack([around.A, unit.A])
    b = around.b if is_box else np.append(around.b, unit.b)
    n_columns = len(b) + sum(net.hidden)
    budget = Budget(max_regions, max_seconds, max_bytes, n_columns)
    lattice = box_complex(unit.lo, unit.hi, n_columns)
    exact = ExactNetwork(A, b, unit.weights, unit.biases)
    oracle = SignOracle(lattice, exact, point_rounding(n, n_columns, 1.0), budget)
    if is_box:
        whole = float(np.prod(unit.hi - unit.lo))
    else:
        _cut_domain(lattice, oracle, unit.A, -unit.b, n_columns, budget)
        whole = domain_volume(lattice)
    _cut_layers(lattice, oracle, unit.weights, unit.biases, len(b), n_columns, budget)
    first_row = 0 if is_box else 2 * n
    return build_table(net, domain, lattice, oracle, unit.scale, whole, first_row)


def _cut_domain(
    lattice: Complex,
    oracle: SignOracle,
    A: Float[np.ndarray, "h n"],
    minus_b: Float[np.ndarray, " h"],
    n_columns: int,
    budget: Budget,
) -> None:
    """Cut the box down to {A y + minus_b <= 0}, row by row."""
    first = 2 * lattice.n
    lattice.set_values(lattice.x.view @ A.T + minus_b)
    before = input_bound(lattice.n)
    largest = np.ones(lattice.n)
    _open_layer(lattice, oracle, None, [A], minus_b, before, largest, first, n_columns)
    for j in range(len(A)):
        codes, slack = oracle.codes(j)
        if not (codes == Sign.MINUS).any():
            raise InputError(
                "domain: expected a polytope with interior; its rows leave none. Widen or drop a "
                "row."
            )
        cut(lattice, codes, first + j, j, slack)
        lattice.bits.mark(first + j, codes)
        oracle.renumber(keep_minus(lattice, first + j))
        budget.check(lattice, first + j + 1)
    if lattice.touches(0, first):
        raise InputError(
            "domain: expected a bounded polytope; it reaches past every bound found for it. Add "
            "rows, or use a Box."
        )


def _cut_layers(
    lattice: Complex,
    oracle: SignOracle,
    weights: Sequence[np.ndarray],
    biases: Sequence[np.ndarray],
    n_rows: int,
    n_columns: int,
    budget: Budget,
) -> None:
    """Cut along every neuron, layer by layer."""
    column = n_rows
    bound = input_bound(lattice.n)
    h = lattice.x.view
    for layer, b in enumerate(biases):
        lattice.set_values(h @ weights[layer].T + b)
        h_max = np.abs(h).max(axis=0, initial=0.0)
        bound = _open_layer(
            lattice, oracle, layer, weights[: layer + 1], b, bound, h_max, column, n_columns
        )
        for j in range(len(b)):
            codes, slack = oracle.codes(j)
            if (codes == Sign.PLUS).any() and (codes == Sign.MINUS).any():
                cut(lattice, codes, column, j, slack)
                lattice.compact()
            lattice.bits.mark(column, codes)
            column += 1
            budget.check(lattice, column)
        # by the exact sign, not by the float's: a neuron of sign 0 feeds exactly 0 forward
        h = lattice.z.view * lattice.bits.is_plus(column - len(b), column)


def _open_layer(
    lattice: Complex,
    oracle: SignOracle,
    layer: int | None,
    weights: Sequence[np.ndarray],
    b: Float[np.ndarray, " w"],
    before: LayerBound,
    h_max: Float[np.ndarray, " inputs"],
    column: int,
    n_columns: int,
) -> LayerBound:
    """Bounds of the layer whose values the complex holds, which the oracle is opened for; `weights`
    are those of all layers up to it.
    """
    lattice.settle()
    done = sum(len(W) for W in weights[:-1])
    on = or_over_cells(lattice.bits.plus.view, lattice.all_rows())
    patterns = unpack(on, column)[:, column - done :]
    lip = cell_gradients(weights, patterns[: 1 if len(weights) == 1 else None])
    z_max = np.abs(lattice.z.view).max(axis=0)
    bound = layer_bound(
        weights[-1], b, before, lip.max(axis=0), h_max, z_max, lattice.n, n_columns, 1.0
    )
    oracle.begin(layer, weights[-1], b, bound, column, lip)
    return bound
