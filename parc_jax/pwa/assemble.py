"""From the finished complex to the region table: numbering, volumes, proof."""

import numpy as np

from parc_jax.pwa.bits import unpack
from parc_jax.pwa.complex import Complex
from parc_jax.pwa.proof import prove_complete
from parc_jax.pwa.recheck import recheck_signs
from parc_jax.pwa.signs import SignOracle
from parc_jax.pwa.table import RegionTable
from parc_jax.pwa.volume import cell_volumes


def build_table(net, domain, lattice: Complex, oracle: SignOracle, scale, domain_volume, first_row: int) -> RegionTable:
    """The proved table of a finished subdivision. Raises SoundnessError when the proof fails.

    scale (n,): unit coordinates to the caller's. domain_volume: in unit coordinates. Columns from first_row on, up to
    those of the neurons, are the rows of the caller's domain.
    """
    n, n_rows = lattice.n, len(oracle.exact.rows)
    boundaries = tuple(lattice.rows(k) for k in range(1, n + 1))
    volumes = cell_volumes(lattice.x.view, boundaries)
    facets, offsets = boundaries[-1]
    count, label = len(offsets) - 1, lattice.label.view[min(n - 1, 1) :]
    facet_label = np.where(label < n_rows, first_row - 1 - label, label - n_rows)

    region = np.repeat(np.arange(count), np.diff(offsets))
    facet_count = np.bincount(facets, minlength=len(label))
    facet_regions = np.full((len(label), 2), -1)
    facet_regions[facets[::-1], 0] = region[::-1]
    facet_regions[facets, 1] = region
    facet_regions[facet_count == 1, 1] = -1

    points, point_error = lattice.x.view * scale, lattice.rho.view[:, None] * scale
    recheck_signs(net, points, point_error, lattice.bits.plus.view, lattice.bits.minus.view, n_rows)
    plus = lattice.signs_of_cells(lattice.bits.plus.view)
    minus = lattice.signs_of_cells(lattice.bits.minus.view)
    faces = [lattice.count(k) - (k > 0) for k in range(n + 1)]
    effort = (oracle.n_signs, oracle.n_exact, oracle.n_repaired)
    proof = prove_complete(volumes, domain_volume, faces, plus, minus, facet_label, facet_count, effort)
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


def domain_volume(lattice: Complex) -> float:
    """Volume of a complex that is one cell, in its own coordinates."""
    return float(cell_volumes(lattice.x.view, tuple(lattice.rows(k) for k in range(1, lattice.n + 1)))[0])
