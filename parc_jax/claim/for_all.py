"""For-all claims from a cover of K, for systems without disturbance and with declared constants.
[T7]
"""

from dataclasses import dataclass

import jax
import numpy as np

from parc_jax.claim.calibrate import Intersample
from parc_jax.claim.claim import ErrorClaim, error_claim
from parc_jax.claim.intersample import DISCRETE_TIME
from parc_jax.claim.measure import Errors, measure_system
from parc_jax.claim.profile import edges_of
from parc_jax.claim.simplices import Simplices, triangulate
from parc_jax.claim.start_gap import invariances
from parc_jax.claim.tube import Tube, tube, zero_tube
from parc_jax.errors import InputError
from parc_jax.keys import Stage
from parc_jax.network.predict import Layout, layout_of
from parc_jax.network.relu import ReLUNetwork
from parc_jax.rollout.law import law_of
from parc_jax.rollout.simulate import Rows, simulator
from parc_jax.rollout.subject import subject_of
from parc_jax.tolerances import TOLERANCES

_UP = 1 + 2.0**-30  # rounding of region maps and of the sums below, upward


@dataclass(frozen=True)
class Lipschitz:
    """Declared: moving k_i by 1 moves p_c(s) by at most p[c, i] [m] at every s, and q_c by at most
    q[c, i].

    p: broadcastable to (n_c, n_k). q: broadcastable to (n_q, n_k).
    """

    p: np.ndarray | float
    q: np.ndarray | float = 0.0


@dataclass(frozen=True)
class Curvature:
    """Declared: p_c(s; k) is differentiable in k, and its gradient changes by at most p[c] |k - k'|
    (Euclidean); same for q.

    p: broadcastable to (n_c,). q: broadcastable to (n_q,).
    """

    p: np.ndarray | float
    q: np.ndarray | float = 0.0


def lipschitz_cover(
    net: ReLUNetwork,
    system,
    key: jax.Array,
    constants: Lipschitz,
    C: np.ndarray,
    cells,
    bins=None,
    *,
    intersample: Intersample = DISCRETE_TIME,
    path=None,
    quiet: bool = False,
) -> ErrorClaim:
    """No run leaves the tube, if the declared constants hold: runs at grid centres, plus what half
    a cell may add. [T7]

    C: (r, n_out, n_k) linear parts of the network on all regions of K (the region table's), which
    give the network's own
    constants. cells: grid cells per axis of K, a multiple of bins per axis. path: resumable, as in
    `collect`.
    Raises InputError, also when the system turns out to have a disturbance.
    """
    check_deterministic(system, key)
    domain = system.domain
    bins = (1,) * domain.n if bins is None else tuple(bins)
    cells = tuple(int(c) for c in cells)
    if len(cells) != domain.n or any(c < b or c % b for c, b in zip(cells, bins, strict=True)):
        raise InputError(
            f"cover: expected cells per axis, a multiple of the bins {bins}; got {cells}."
        )
    edges = edges_of(domain, cells)
    middles = [0.5 * (e[1:] + e[:-1]) for e in edges]
    centres = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1).reshape(-1, domain.n)
    errors = _errors_at(net, system, key, centres, path, quiet)
    half = np.array([np.diff(e).max() for e in edges]) / 2
    layout = layout_of(system)
    slope = _network_slopes(C, layout)
    declared_p = _constant("p", constants.p, (layout.n_c, domain.n))
    declared_q = _constant("q", constants.q, (system.n_q, domain.n))
    # by how much the error may grow between the centre of a cell and its farthest point
    growth_interval = (slope.interval + declared_p[None]) @ half
    growth_final = (slope.final + np.concatenate([declared_p, declared_q])) @ half
    found = tube(
        edges_of(domain, bins),
        (_bin_maxima(errors.interval, cells, bins) + growth_interval) * _UP,
        (_bin_maxima(errors.final, cells, bins) + growth_final) * _UP,
        layout.n_points,
    )
    label = f"LIPSCHITZ(p <= {_text(constants.p)}, q <= {_text(constants.q)} per unit of k)"
    return _claim(net, system, found, len(centres), label, intersample)


def _bin_maxima(errors: np.ndarray, cells: tuple[int, ...], bins: tuple[int, ...]) -> np.ndarray:
    """(n_bins, ...) largest of the errors (n_cells, ...) in each bin; a bin is a block of cells."""
    blocks: list[int] = []
    for n_cells, n_bins in zip(cells, bins, strict=True):
        blocks += [n_bins, n_cells // n_bins]
    inside = tuple(range(1, 2 * len(cells), 2))
    largest = errors.reshape(*blocks, *errors.shape[1:]).max(axis=inside)
    return largest.reshape(-1, *errors.shape[1:])


def curvature_cover(
    net: ReLUNetwork,
    system,
    key: jax.Array,
    constants: Curvature,
    vertices: list[np.ndarray],
    size: float,
    bins=None,
    *,
    intersample: Intersample = DISCRETE_TIME,
    path=None,
    quiet: bool = False,
) -> ErrorClaim:
    """No run leaves the tube, if the declared constants hold: runs at vertices of simplices,
    network affine on each.

    On a simplex with edges <= h the error is at most its largest at a vertex plus M h^2 n_k / (4
    (n_k + 1)). [T7]
    vertices: per region of the network, its vertices (v, n_k), together covering K. size: longest
    edge allowed, as a share of
    the widths of K. Raises InputError; SoundnessError when the regions do not fill K.
    """
    check_deterministic(system, key)
    domain = system.domain
    n = domain.n
    mesh = triangulate(vertices, domain, size)
    errors = _errors_at(net, system, key, np.clip(mesh.points, domain.lo, domain.hi), path, quiet)
    layout = layout_of(system)
    declared_p = _constant("p", constants.p, (layout.n_c,))
    declared_q = _constant("q", constants.q, (system.n_q,))
    bend = mesh.longest**2 * n / (4 * (n + 1))
    edges = edges_of(domain, (1,) * n if bins is None else bins)
    largest = _simplex_maxima(
        mesh, errors, bend, declared_p, np.concatenate([declared_p, declared_q]), edges
    )
    # region vertices are floats: a kink of the network may lie this far inside a simplex, and
    # simplices this far apart
    loose = TOLERANCES.vertex_relative * np.abs(np.concatenate([domain.lo, domain.hi])).max()
    slack = loose * _steepest(net)
    widths = ((largest.interval + slack) * _UP, (largest.final + slack) * _UP)
    found = tube(edges, *widths, layout.n_points)
    label = f"CURVATURE(p <= {_text(constants.p)}, q <= {_text(constants.q)} per squared unit of k)"
    return _claim(net, system, found, len(mesh.points), label, intersample)


def check_deterministic(system, key: jax.Array, n: int = 16) -> None:
    """Refuse a system whose runs depend on its key: a cover of K says nothing about
    disturbances.
    """
    sim = simulator(system)
    keys, k = sim.rows(key, Stage.SEARCH, np.arange(n))
    first, second = sim.run(Rows(keys, k)), sim.run(Rows(keys[::-1], k))
    if not all(np.array_equal(a, b, equal_nan=True) for a, b in zip(first, second, strict=True)):
        raise InputError(
            f"cover: expected a system without disturbance; {system.name} answers one k "
            "differently for another key. "
            "Make the disturbance part of k, or use bound_error."
        )


def _errors_at(net, system, key, k: np.ndarray, path, quiet) -> Errors:
    drawn, errors = measure_system(
        net, system, key, len(k), Stage.BOUND, k=k, path=path, quiet=quiet
    )
    if not np.array_equal(drawn, k):
        raise InputError(
            "cover: expected a float64 system; this one cannot run the points of the cover exactly."
        )
    return errors


def _network_slopes(C: np.ndarray, layout: Layout) -> Errors:
    """Largest |d output / d k_i| over regions: interval (T, n_c, n_k) over both end knots, final
    (n_c + n_q, n_k).
    """
    steepest = np.abs(np.asarray(C, np.float64)).max(axis=0)
    start = np.zeros((layout.n_p, steepest.shape[1]))
    moving = np.concatenate([start, steepest[: layout.n_offsets]])
    knots = moving.reshape(-1, layout.n_c, steepest.shape[1])
    at_end = steepest[layout.n_offsets - layout.n_c :]
    return Errors(np.maximum(knots[:-1], knots[1:]), at_end)


def _constant(name: str, value, shape: tuple[int, ...]) -> np.ndarray:
    """A declared constant, broadcast to its shape."""
    value = np.asarray(value, np.float64)
    if not (np.isfinite(value) & (value >= 0)).all():
        raise InputError(f"cover: expected declared constants {name} >= 0; got {value}.")
    return np.broadcast_to(value, shape)


def _simplex_maxima(mesh: Simplices, errors: Errors, bend, M_p, M_final, edges) -> Errors:
    """Per bin: largest vertex error over simplices whose bounding box meets the bin, plus the bend
    of each.
    """
    corners = mesh.points[mesh.corners]
    low, high = corners.min(axis=1), corners.max(axis=1)
    at_interval = errors.interval[mesh.corners].max(axis=1) + bend[:, None, None] * M_p
    at_final = errors.final[mesh.corners].max(axis=1) + bend[:, None] * M_final
    bins = zero_tube(edges, *errors.interval.shape[1:], errors.final.shape[1])
    interval = []
    final = []
    for number in range(bins.n_bins):
        lo, hi = bins.bin_box(number)
        meets = ((low <= hi) & (high >= lo)).all(axis=1)
        interval.append(at_interval[meets].max(axis=0))
        final.append(at_final[meets].max(axis=0))
    return Errors(np.stack(interval), np.stack(final))


def _text(value) -> str:
    return str(np.asarray(value).tolist())


def _steepest(net: ReLUNetwork) -> float:
    """A crude bound on twice the network's largest derivative: row sums of the product of |W|."""
    product = np.abs(net.weights[0])
    for W in net.weights[1:]:
        product = np.abs(W) @ product
    return 2.0 * float(product.sum(axis=1).max())


def _claim(net, system, found: Tube, n: int, label: str, intersample: Intersample) -> ErrorClaim:
    h, about = system.time.dt_record, subject_of(system)
    term = intersample.term(h, system.n_p, found.n_points)
    interval = np.nextafter(found.interval + term, np.inf)
    return error_claim(
        kind="cover",
        tube=tube(found.edges, interval, found.final, found.n_points),
        subject=about,
        network=net.hash,
        quantifier=f"for every k in K of {system.name}, which has no disturbance",
        eps=None,
        delta=None,
        n=n,
        discard=0,
        looks=1,
        law=law_of(system, "given"),
        assumptions=(
            label,
            "NO_DISTURBANCE",
            *invariances(about.rotation),
            intersample.assumption(h),
        ),
        intersample=tuple(term),
    )
