"""From the finished complex to the region table: numbering, volumes, proof."""

import numpy as np
from jaxtyping import Float

from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.regions.complex import Complex
from parc_jax.proof.regions.proof import prove_complete, recheck_signs
from parc_jax.proof.regions.signs import SignOracle
from parc_jax.proof.regions.storage import or_over_cells, unpack
from parc_jax.proof.regions.table import RegionTable
from parc_jax.proof.regions.volume import cell_volumes


def build_table(
    net: ReLUNetwork,
    domain: Box | HPolytope,
    lattice: Complex,
    oracle: SignOracle,
    scale: Float[np.ndarray, " n"],
    domain_volume: float,
    first_row: int,
) -> RegionTable:
    """The proved table of a finished subdivision. Raises SoundnessError when the proof fails.

    scale (n,): unit coordinates to the caller's. domain_volume: in unit coordinates. Columns from
    first_row on, up to those of the neurons, are the rows of the caller's domain.
    """
    n = lattice.n
    n_rows = len(oracle.exact.rows)
    boundaries = tuple(lattice.all_rows(drop=True))
    volumes = cell_volumes(lattice.x.view, boundaries)
    column = lattice.label.view[min(n - 1, 1) :]
    facet_label = np.where(column < n_rows, first_row - 1 - column, column - n_rows)
    facet_regions, facet_count = _sides(*boundaries[-1], len(column))

    points = lattice.x.view * scale
    point_error = lattice.rho.view[:, None] * scale
    plus = lattice.bits.plus.view
    minus = lattice.bits.minus.view
    recheck_signs(net, points, point_error, plus, minus, n_rows)
    words = plus.shape[1]
    both = or_over_cells(np.concatenate([plus, minus], axis=1), boundaries)
    plus = both[:, :words]
    minus = both[:, words:]
    faces = [lattice.count(k) - (k > 0) for k in range(n + 1)]
    effort = (oracle.n_signs, oracle.n_exact, oracle.n_repaired)
    proof = prove_complete(
        volumes, domain_volume, faces, plus, minus, facet_label, facet_count, effort
    )
    unit = float(np.prod(scale))
    return RegionTable(
        net=net,
        domain=domain,
        patterns=unpack(plus, n_rows + sum(net.hidden))[:, n_rows:],
        volumes=volumes * unit,
        points=points,
        point_error=point_error,
        boundaries=boundaries,
        facet_label=facet_label,
        facet_regions=facet_regions,
        proof=proof.replace(volume=proof.volume * unit, domain_volume=proof.domain_volume * unit),
    )


def _sides(facets: np.ndarray, offsets: np.ndarray, n_facets: int) -> tuple[np.ndarray, np.ndarray]:
    """The regions (f, 2) on the two sides of each facet, -1 for outside, and their number (f,)."""
    region = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    count = np.bincount(facets, minlength=n_facets)
    sides = np.full((n_facets, 2), -1)
    # of several assignments to one facet the last one stays: the first region, then the last
    sides[facets[::-1], 0] = region[::-1]
    sides[facets, 1] = region
    sides[count == 1, 1] = -1
    return sides, count


def domain_volume(lattice: Complex) -> float:
    """Volume of a complex that is one cell, in its own coordinates."""
    return float(cell_volumes(lattice.x.view, tuple(lattice.all_rows()))[0])
