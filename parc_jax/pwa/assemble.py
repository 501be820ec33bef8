"""From the finished complex to the region table: numbering, incidence, volumes, proof."""

import numpy as np

from parc_jax.pwa.complex import Complex, unpack
from parc_jax.pwa.proof import prove_complete
from parc_jax.pwa.signs import SignOracle
from parc_jax.pwa.table import RegionTable
from parc_jax.pwa.volume import cell_volumes


def build_table(net, domain, lattice: Complex, oracle: SignOracle, scale, domain_volume, first_row, n_rows) -> RegionTable:
    """The proved table of a finished subdivision. Raises SoundnessError when the proof fails.

    scale (n,): unit coordinates to the caller's. domain_volume: in unit coordinates. Columns first_row..n_rows-1 are the
    rows of the caller's domain; those after are the neurons.
    """
    n = lattice.n
    rows = {k: lattice.rows(k) for k in range(1, n + 1)}
    volumes = cell_volumes(lattice.x.view, rows)
    facet_vertices, cell_vertices = _vertices(rows, n, lattice.x.n)
    facet_index, size = rows[n]
    count, label = len(size), lattice.label.view[min(n - 1, 1) :]
    facet_label = np.where(label < n_rows, first_row - 1 - label, label - n_rows)

    region = np.repeat(np.arange(count), size)
    facet_count = np.bincount(facet_index, minlength=len(label))
    facet_regions = np.full((len(label), 2), -1)
    facet_regions[facet_index[::-1], 0] = region[::-1]
    facet_regions[facet_index, 1] = region
    facet_regions[facet_count == 1, 1] = -1

    offsets = cell_vertices[1][:-1]
    plus = np.bitwise_or.reduceat(lattice.bits.plus.view[cell_vertices[0]], offsets, axis=0)
    minus = np.bitwise_or.reduceat(lattice.bits.minus.view[cell_vertices[0]], offsets, axis=0)
    faces = [lattice.count(k) - (k > 0) for k in range(n + 1)]
    effort = (oracle.n_signs, oracle.n_exact, oracle.n_repaired)
    proof = prove_complete(volumes, domain_volume, faces, plus, minus, facet_label, facet_count, effort)
    unit = float(np.prod(scale))
    return RegionTable(
        net=net,
        domain=domain,
        patterns=unpack(plus, n_rows + sum(net.hidden))[:, n_rows:],
        volumes=volumes * unit,
        points=lattice.x.view * scale,
        point_error=lattice.rho.view.copy(),
        vertex_index=cell_vertices[0],
        vertex_offsets=cell_vertices[1],
        facet_index=facet_index,
        facet_offsets=np.concatenate([[0], np.cumsum(size)]),
        facet_label=facet_label,
        facet_regions=facet_regions,
        facet_vertex_index=facet_vertices[0],
        facet_vertex_offsets=facet_vertices[1],
        proof=proof.replace(volume=proof.volume * unit, domain_volume=proof.domain_volume * unit),
    )


def lattice_volumes(lattice: Complex) -> np.ndarray:
    """Volumes (r,) of the cells of a complex in its own coordinates."""
    return cell_volumes(lattice.x.view, {k: lattice.rows(k) for k in range(1, lattice.n + 1)})


def _vertices(rows, n: int, n_points: int):
    """Vertices of the facets and of the cells, each as (flat, offsets)."""
    flat, offsets = rows[1][0], 2 * np.arange(len(rows[1][1]) + 1)
    facets = (np.arange(n_points), np.arange(n_points + 1)) if n == 1 else (flat, offsets)
    for k in range(2, n + 1):
        facets = flat, offsets
        sub, size = rows[k]
        length = np.diff(offsets)[sub]
        owner = np.repeat(np.repeat(np.arange(len(size)), size), length)
        ends = np.cumsum(length)
        at = np.arange(ends[-1]) + np.repeat(offsets[sub] - (ends - length), length)
        key = owner * n_points + flat[at]
        key.sort()
        key = key[np.concatenate([[True], key[1:] != key[:-1]])]
        owner, flat = np.divmod(key, n_points)
        offsets = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=len(size)))])
    return facets, (flat, offsets)
