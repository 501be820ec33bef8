"""Reachable polyhedral marching: region after region outward from a seed, one facet at a time
(Vincent, Schwager 2021).

No table, no limit on the number of inputs. Facets by LPs, the pattern behind a facet by exact
comparison of affine forms, so neurons that are constant, dead, rescaled or nearly parallel neither
switch by mistake nor hide a region [A7, A8, A9].
"""

from collections import deque
from collections.abc import Iterator, Sequence

import jax
import numpy as np

from parc_jax.common import struct
from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.regions.domain import UnitProblem, interior_point, unit_problem
from parc_jax.proof.regions.exact import ExactNetwork
from parc_jax.proof.regions.facets import find_facets
from parc_jax.proof.regions.halfspaces import halfspaces, pattern_across, pattern_at
from parc_jax.proof.regions.locate import inside_domain


@struct.dataclass
class MarchedRegion:
    """One region {x : A x <= b} without redundant rows, f facets.

    pattern: (n_hidden,) bool. A: (f, n), b: (f,).
    label: (f,) hidden neuron of each facet, or -1 - (row of the domain).
    neighbours: (f, n_hidden) bool, the pattern behind each facet; its own behind the domain's
        boundary.
    """

    pattern: np.ndarray
    A: np.ndarray
    b: np.ndarray
    label: np.ndarray
    neighbours: np.ndarray


def march(
    net: ReLUNetwork, domain: Box | HPolytope, seed: Sequence[float] | np.ndarray | jax.Array
) -> Iterator[MarchedRegion]:
    """Regions of `net` over `domain`, breadth first from the one that contains `seed` (n,); every
    region once.

    Lazy: stop asking and it stops working. Any number of inputs. Raises InputError when the seed is
    outside the domain.
    """
    unit = unit_problem(net, domain)
    seed = as_float64("march seed", seed, (net.n_in,))
    if not inside_domain(domain, seed[None])[0]:
        raise InputError(f"march: expected a seed inside the domain; got {seed}.")
    start = seed / unit.scale
    network = ExactNetwork(unit.A, unit.b, unit.weights, unit.biases)
    first = pattern_at(network, start, interior_point(domain) / unit.scale - start)
    return _march(network, unit, first)


def _march(network: ExactNetwork, unit: UnitProblem, first: np.ndarray) -> Iterator[MarchedRegion]:
    waiting = deque([first])
    seen = {first.tobytes()}
    while waiting:
        on = waiting.popleft()
        rows = halfspaces(network, on)
        facets = find_facets(rows, unit.lo, unit.hi)
        across = [
            on if rows.label[i] < 0 else pattern_across(network, on, rows, i)
            for i in facets.tolist()
        ]
        neighbours = np.array(across)
        # in the caller's coordinates, largest gradient entry in [1/2, 1)
        table = rows.unit[facets] * np.append(1 / unit.scale, -1.0)
        _, exponent = np.frexp(np.abs(table[:, :-1]).max(axis=1))
        table = np.ldexp(table, -exponent[:, None])
        yield MarchedRegion(on, table[:, :-1], table[:, -1], rows.label[facets], neighbours)
        for pattern in neighbours:
            if pattern.tobytes() not in seen:
                seen.add(pattern.tobytes())
                waiting.append(pattern)
