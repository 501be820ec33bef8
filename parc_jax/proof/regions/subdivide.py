"""`enumerate_regions`: every linear region of a ReLU network over a domain, by exact subdivision
[T16].

Keep one side of a cut: the part of the complex where a hyperplane's sign is minus or zero.
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
from parc_jax.proof.regions.assemble import build_table, cell_volumes
from parc_jax.proof.regions.complex import Budget, Complex, Level, Sign
from parc_jax.proof.regions.cut import cut
from parc_jax.proof.regions.domain import MAX_DIMENSION, box_complex, unit_problem
from parc_jax.proof.regions.exact import ExactNetwork
from parc_jax.proof.regions.rounding import (
    LayerBound,
    cell_gradients,
    input_bound,
    layer_bound,
    point_rounding,
)
from parc_jax.proof.regions.signs import SignOracle
from parc_jax.proof.regions.storage import Growable, Ragged, or_over_cells, row_positions, unpack
from parc_jax.proof.regions.table import RegionTable


def keep_minus(lattice: Complex, column: int) -> np.ndarray:
    """Drop all faces with a vertex of sign plus at `column`, and faces left without a cell. In
    place; for small complexes.

    Returns the new number of every old vertex, -1 where it was dropped.
    """
    n = lattice.n
    plus = lattice.bits.is_plus(column, column + 1)[:, 0]
    if not plus.any():
        return np.arange(lattice.x.n)
    rows = {k: lattice.rows(k) for k in range(1, n + 1)}
    radius = {k: lattice.radius(k).view[1:] for k in range(1, n)}
    label = lattice.label.view[1:] if n > 1 else lattice.label.view
    kept = _kept_faces(rows, plus, n)
    number = {k: np.where(kept[k], np.cumsum(kept[k]) - 1, -1) for k in range(n + 1)}

    sub, _ = _kept_rows(rows[1], kept[1], number[0])
    ends = sub.reshape(-1, 2)
    lattice.set_edges(ends[:, 0], ends[:, 1], radius[1][kept[1]] if n > 1 else None)
    first = ends[:, 0]
    lattice.levels = {}
    for k in range(2, n + 1):
        sub, size = _kept_rows(rows[k], kept[k], number[k - 1])
        first = first[sub[np.cumsum(size) - size]]
        lattice.levels[k] = Level(sub + 1, size, first, radius[k][kept[k]] if k < n else None)
    lattice.x = Growable(lattice.x.view[kept[0]])
    lattice.z = Growable(lattice.z.view[kept[0]])
    lattice.rho = Growable(lattice.rho.view[kept[0]])
    lattice.vertex_home = Growable(lattice.vertex_home.view[kept[0]])
    lattice.bits = lattice.bits.kept(kept[0])
    lattice.set_labels(label[kept[n - 1]])
    return number[0]


def _kept_faces(rows: dict[int, Ragged], plus: np.ndarray, n: int) -> dict[int, np.ndarray]:
    """Bool per k-face, k = 0..n: it stays."""
    dropped = plus
    count = {0: len(plus)}
    for k in range(1, n + 1):
        sub, offsets = rows[k]
        count[k] = len(offsets) - 1
        has_dropped = np.zeros(count[k], bool)
        has_dropped[np.repeat(np.arange(count[k]), np.diff(offsets))[dropped[sub]]] = True
        dropped = has_dropped
    # what remains of dimension < n must bound a remaining face one dimension up
    kept = {n: ~dropped}
    for k in range(n, 0, -1):
        sub, offsets = rows[k]
        kept[k - 1] = np.zeros(count[k - 1], bool)
        kept[k - 1][sub[np.repeat(kept[k], np.diff(offsets))]] = True
    return kept


def _kept_rows(rows: Ragged, kept: np.ndarray, number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Boundaries of the remaining faces in new numbers, flat, and their sizes."""
    sub, offsets = rows
    size = np.diff(offsets)[kept]
    positions, _ = row_positions(offsets[:-1][kept], size)
    return number[sub[positions]], size


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
            f"enumerate_regions: expected at most {MAX_DIMENSION} inputs; got {net.n_in}. "
            "Corridors need no regions: `Planner.solve` takes any number."
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
    oracle = SignOracle(lattice, exact, point_rounding(n, n_columns), budget)
    if is_box:
        whole = float(np.prod(unit.hi - unit.lo))
    else:
        _cut_domain(oracle, unit.A, -unit.b)
        whole = float(cell_volumes(lattice.x.view, tuple(lattice.all_rows()))[0])
    _cut_layers(oracle, unit.weights, unit.biases)
    first_row = 0 if is_box else 2 * n
    return build_table(net, domain, lattice, oracle, unit.scale, whole, first_row)


def _cut_domain(
    oracle: SignOracle, A: Float[np.ndarray, "h n"], minus_b: Float[np.ndarray, " h"]
) -> None:
    """Cut the box down to {A y + minus_b <= 0}, row by row."""
    lattice = oracle.lattice
    first = 2 * lattice.n
    lattice.set_values(lattice.x.view @ A.T + minus_b)
    before = input_bound(lattice.n)
    _open_layer(oracle, None, [A], minus_b, before, np.ones(lattice.n), first)
    for j in range(len(A)):
        codes, plane = oracle.codes(j)
        if not (codes == Sign.MINUS).any():
            raise InputError(
                "domain: expected a polytope with interior; its rows leave none. Widen or drop a "
                "row."
            )
        cut(lattice, codes, plane)
        lattice.bits.mark(plane.column, codes)
        oracle.renumber(keep_minus(lattice, plane.column))
        oracle.budget.check(lattice, plane.column + 1)
    if lattice.touches(0, first):
        raise InputError(
            "domain: expected a bounded polytope; it reaches past every bound found for it. Add "
            "rows, or use a Box."
        )


def _cut_layers(
    oracle: SignOracle, weights: Sequence[np.ndarray], biases: Sequence[np.ndarray]
) -> None:
    """Cut along every neuron, layer by layer."""
    lattice = oracle.lattice
    column = len(oracle.exact.rows)
    bound = input_bound(lattice.n)
    h = lattice.x.view
    for layer, b in enumerate(biases):
        lattice.set_values(h @ weights[layer].T + b)
        h_max = np.abs(h).max(axis=0, initial=0.0)
        bound = _open_layer(oracle, layer, weights[: layer + 1], b, bound, h_max, column)
        for j in range(len(b)):
            codes, plane = oracle.codes(j)
            if (codes == Sign.PLUS).any() and (codes == Sign.MINUS).any():
                cut(lattice, codes, plane)
                lattice.compact()
            lattice.bits.mark(column, codes)  # after the cut, whose new vertices are zero here
            column += 1
            oracle.budget.check(lattice, column)
        # by the exact sign, not by the float's: a neuron of sign 0 feeds exactly 0 forward
        h = lattice.z.view * lattice.bits.is_plus(column - len(b), column)


def _open_layer(
    oracle: SignOracle,
    layer: int | None,
    weights: Sequence[np.ndarray],
    b: Float[np.ndarray, " w"],
    before: LayerBound,
    h_max: Float[np.ndarray, " inputs"],
    column: int,
) -> LayerBound:
    """Bounds of the layer whose values the complex holds, which the oracle is opened for; `weights`
    are those of all layers up to it.
    """
    lattice = oracle.lattice
    lattice.settle()
    done = sum(len(W) for W in weights[:-1])
    on = or_over_cells(lattice.bits.plus.view, lattice.all_rows())
    patterns = unpack(on, column)[:, column - done :]
    lip = cell_gradients(weights, patterns[: 1 if len(weights) == 1 else None])
    z_max = np.abs(lattice.z.view).max(axis=0)
    bound = layer_bound(weights[-1], b, before, lip.max(axis=0), h_max, z_max, oracle.delta)
    oracle.begin(layer, weights[-1], b, bound, column, lip)
    return bound
