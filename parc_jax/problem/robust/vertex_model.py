"""The model of all vertex realisations at once: its reference points are those of the robot in all,
and its body parts are the hulls over them. [T21, T22]

A true run is a mixture of the executions at the corners under a turn that is a mixture of some maps
(`realisations`), plus the gap of the mixture (`bend`) and the error of the model, turned. A plan
that keeps the hull of all these points clear keeps the true run clear.
"""

import itertools
import math
import operator
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from parc_jax.checker.claim import words_of
from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import round_down, round_up
from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.bound.tube import Tube, tube
from parc_jax.learning.labels import labels as valid_labels
from parc_jax.learning.labels import named_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import Layout
from parc_jax.learning.network.relu import ReLUNetwork, relu_network
from parc_jax.learning.network.rounding import TINY, UNIT
from parc_jax.problem.body import Body, Part, numbered
from parc_jax.problem.problem import Problem
from parc_jax.problem.robust.bend import bend_by_bin
from parc_jax.problem.robust.realisations import Executions, Turn

MOST = 64  # reference points that the checker takes, each execution with its own
UP_WIDTH = 1 + 2.0**-30  # pays for the sums that make a width
UP_BOUND = 1 + 2.0**-10  # pays for evaluating a bound in float64
MOST_BINS = 256  # new bins, unless there are more old ones
COARSEST = 1e6  # [finest width] at which refining ends


class Axis(NamedTuple):
    """Bins along one axis of k.

    edges: of the new bins; None for a parameter that no plan chooses.
    met: (first, last) old bin that the executions of each new bin may be in.
    """

    edges: np.ndarray | None
    met: list[tuple[int, int]]


class Copied(NamedTuple):
    """The network of all vertex realisations.

    net: of the chosen parameters.
    rounding: (T + 1, m, V, R, n_p) [m] bound of the distance of its points from the exact ones.
    rounding_q: (V, n_q) the same of the further goal states.
    """

    net: ReLUNetwork
    rounding: np.ndarray
    rounding_q: np.ndarray


def copied_model(model: TrajectoryModel, executions: Executions, turn: Turn) -> TrajectoryModel:
    """The model of the chosen parameters, with the points of the given model in every execution
    under every map of the turn.

    Raises InputError where these points are more than a certificate may have.
    """
    n_v, n_r = len(executions.corners), len(turn.maps)
    if model.n_points * n_v * n_r > MOST:
        raise InputError(
            f"uncertainty: expected at most {MOST} reference points, each with all its executions; "
            f"got {model.n_points} with {n_v * n_r}. Bound the uncertainty of fewer parameters, or "
            "use fewer points."
        )
    axes = axes_of(model.tube.edges, executions)
    edges = tuple(axis.edges for axis in axes if axis.edges is not None)
    domain = Box(np.array([e[0] for e in edges]), np.array([e[-1] for e in edges]))
    one = copied(model.net, model.layout, executions, turn.maps, domain)
    wider = _tube(model, executions, turn, axes, edges, one)
    chosen = list(executions.chosen)
    named = model.labels
    several = n_v * n_r > 1
    each = [f"in execution {v}" for v in range(n_v)]
    q = named.q if n_v == 1 else [named_of(x, of) for of in each for x in named.q]
    k = [named.k[axis] for axis in chosen]
    subject = replace(
        model.claim.subject,
        domain=domain,
        points=_copies_of(model.points, n_v * n_r) if several else model.points,
        rotation=None if model.rotation is None else model.rotation * n_v,
        given=tuple(chosen.index(axis) for axis in model.given if axis in chosen),  # if free
        labels=valid_labels(model.n_p, model.n_q * n_v, len(chosen), named.p, q, k),
    )
    bin_eps, known = None, model.claim.bin_eps
    if known is not None:  # of a new bin the largest of the old ones that its runs may be in
        least = np.array([np.inf if e is None else float(e) for e in known])
        by_value = {float(e): e for e in known if e is not None}
        bin_eps = tuple(by_value.get(float(e)) for e in widest(least, model.tube.grid, axes))
    # the law of k says nothing about parameters that no plan chooses
    not_drawn = [p.words for p in executions.parameters if p.source is not None]
    about = {"network_of_runs": model.claim.network, "not_drawn": not_drawn}
    changes = {"tube": wider, "subject": subject, "network": one.net.hash, "bin_eps": bin_eps}
    if bin_eps is not None:
        about["bin_share"] = None  # of other bins than these
        # runs were counted in the old bins alone, so of a new one by itself nothing is known
        facts = model.claim.facts()
        changes["quantifier"] = words_of(facts, facts["law"])[1]
    claim = derived(model.claim, **changes, evidence=about)
    return model.replace(net=one.net, claim=claim, held=None)


def copied_problem(problem: Problem, model: TrajectoryModel, n_v: int, n_r: int) -> Problem:
    """The problem about all vertex realisations: hulls over their points, and a goal for each.

    model: before they were added. n_v, n_r: number of executions and of maps.
    """
    several = n_v * n_r
    if several == 1:
        return problem
    parts = tuple(
        Part(tuple(i * several + c for i in part.points for c in range(several)), part.shape)
        for part in numbered(problem.body, model.points)
    )
    goal = problem.goal
    n_c, n_p, n_q, rows = model.n_c, model.n_p, model.n_q, len(problem.goal.b)
    blocks = []
    for v, r in itertools.product(range(n_v), range(n_r)):
        ends = np.zeros((rows, model.n_points, n_v, n_r, n_p))
        further = np.zeros((rows, n_v, n_q))
        ends[:, :, v, r] = goal.A[:, :n_c].reshape(rows, model.n_points, n_p)
        further[:, v] = goal.A[:, n_c:]
        blocks.append(np.concatenate([ends.reshape(rows, -1), further.reshape(rows, -1)], axis=1))
    every = HPolytope(np.concatenate(blocks), np.tile(goal.b, several))
    points = _copies_of(problem.points, several)
    body = Body(parts, getattr(problem.body, "places", ()))
    return replace(problem, body=body, goal=every, points=points)


def _tube(
    model: TrajectoryModel, executions: Executions, turn: Turn, axes: list[Axis], edges, one: Copied
) -> Tube:
    """The tube of all vertex realisations: the errors of all bins that an execution may be in, the
    gap of the mixture and rounding, turned.
    """
    old, layout = model.tube, model.layout
    n_t, n_p, m = layout.n_steps, layout.n_p, layout.n_points
    n_v, n_r = len(executions.corners), len(turn.maps)
    interval = widest(old.interval, old.grid, axes).reshape(-1, n_t, m, n_p)
    final = widest(old.final, old.grid, axes)
    n_bins = len(interval)
    lo, hi = boxes(axes, executions)
    missed = bend_by_bin(model.net, lo, hi, executions.widths)
    at_knots, missed_q = _knots(missed, layout)
    # between two knots the prediction is straight, so its gap is no larger than at one of them
    both = np.maximum(at_knots[:, :-1], at_knots[:, 1:])
    rounding = np.maximum(one.rounding[:-1], one.rounding[1:])
    shape = (n_bins, n_t, m, n_v, n_r, n_p)
    during = turn.widened(interval + both)[:, :, :, None, None] + rounding
    ends = turn.widened(final[:, : layout.n_c].reshape(-1, m, n_p) + at_knots[:, -1])
    ends = ends[:, :, None, None] + one.rounding[-1]
    q = final[:, layout.n_c :] + missed_q + turn.of_q
    q = q[:, None] + one.rounding_q
    during = np.broadcast_to(during, shape).reshape(n_bins, n_t, -1)
    ends = np.broadcast_to(ends, (n_bins, *shape[2:])).reshape(n_bins, -1)
    at_end = np.concatenate([ends, q.reshape(n_bins, -1)], axis=1)
    return tube(edges, during * UP_WIDTH, at_end * UP_WIDTH, m * n_v * n_r)


def _knots(values: np.ndarray, layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Outputs as (b, T + 1, m, n_p, ...), zero where the first point starts, and (b, n_q, ...)."""
    rest = values.shape[2:]
    start = np.zeros((len(values), layout.n_p, *rest))
    knots = np.concatenate([start, values[:, : layout.n_offsets]], axis=1)
    shape = (len(values), layout.n_steps + 1, layout.n_points, layout.n_p, *rest)
    return knots.reshape(shape), values[:, layout.n_offsets :]


def _copies_of(points: Sequence[str], several: int) -> tuple[str, ...]:
    """Names of the realisations of all points, grouped by point."""
    return tuple(f"{point} {c}" for point in points for c in range(several))


def copied(
    net: ReLUNetwork, layout: Layout, executions: Executions, turns: np.ndarray, domain: Box
) -> Copied:
    """One network for all vertex realisations, side by side in every layer.

    turns: (R, n_p, n_p) maps of the offsets.
    domain: of the chosen parameters.
    Returns outputs in the order knot, point (m), execution (V), map (R); then q of every execution.
    """
    corners, chosen = executions.corners, list(executions.chosen)
    n_v = len(corners)
    shifted = [_shifted(net.weights[0], net.biases[0], corner) for corner in corners]
    first = np.concatenate([net.weights[0][:, chosen]] * n_v)
    weights = [first, *(np.kron(np.eye(n_v), W) for W in net.weights[1:])]
    biases = [np.concatenate([b for b, _ in shifted]), *(np.tile(b, n_v) for b in net.biases[1:])]
    error = np.concatenate([e for _, e in shifted])
    size = np.maximum(np.abs(domain.lo), np.abs(domain.hi))
    for depth, (W, b) in enumerate(zip(weights, biases, strict=True)):
        if depth:  # errors of the first layer grow by at most |W| in every later one
            error = np.abs(W) @ error * UP_BOUND
        if depth + 1 < len(weights):
            size = (np.abs(W) @ size + np.abs(b)) * UP_BOUND
    W, b, e = (x.reshape(n_v, net.n_out, -1) for x in (weights[-1], biases[-1], error))
    # rows of the output layer (V, T + 1, m, n_p, c), and of q (V, n_q, c)
    (W, W_q), (b, b_q), (e, e_q) = (_knots(x, layout) for x in (W, b, e))
    turned = "rpa,vtmac->tmvrpc"
    out = [np.einsum(turned, turns, part) for part in (W, b)]
    wide = np.einsum(turned, np.abs(turns), np.abs(W)) @ size
    wide = wide + np.einsum(turned, np.abs(turns), np.abs(b))[..., 0]
    error = np.einsum(turned, np.abs(turns), e)[..., 0]
    exact = np.isin(turns, (0.0, 1.0)).all() and (turns.sum(axis=2) == 1).all()
    # a map of zeros and ones rounds nothing
    rounds = 0.0 if exact else 8 * UNIT * wide + 8 * TINY
    n_c = W.shape[-1]
    last = np.concatenate([out[0].reshape(-1, n_c)[layout.n_p :], W_q.reshape(-1, n_c)])
    offsets = np.concatenate([out[1].ravel()[layout.n_p :], b_q.ravel()])
    net = relu_network([*weights[:-1], last], [*biases[:-1], offsets])
    return Copied(net, (error + rounds) * UP_BOUND, e_q[..., 0] * UP_BOUND)


def _shifted(W: np.ndarray, b: np.ndarray, corner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bias of the first layer at a corner of the box of executions, and its rounding errors."""
    if not corner.any():
        return b, np.zeros(len(b))
    by = [Fraction(x) for x in corner]
    values, errors = [], []
    for row, own in zip(W, b, strict=True):
        exact = Fraction(own) + sum(Fraction(w) * x for w, x in zip(row, by, strict=True))
        values.append(float(exact))
        errors.append(float(abs(exact - Fraction(values[-1]))) * UP_BOUND)
    return np.array(values), np.array(errors)


def axis_of(edges: np.ndarray, lo: float, hi: float, chosen: bool, finest: float = np.inf) -> Axis:
    """New bins along one axis, edges rounded so that no plan is in a bin with too few errors.

    edges: of the old bins.
    lo, hi: executions add values between these to a chosen parameter; others have such values.
    finest: largest width of the new bins where executions add something.
    """
    exact = [Fraction(e) for e in edges]
    low, high = Fraction(lo), Fraction(hi)
    if not chosen:
        return Axis(None, [_met(exact, low, high, closed=True)])
    if low == high == 0:
        return Axis(edges, [(i, i) for i in range(len(edges) - 1)])
    first, last = round_up(exact[0] - low), round_down(exact[-1] - high)
    # around every old edge a new bin of its own, whose executions may be on both sides of it
    inner = [f for e in exact[1:-1] for f in (round_down(e - high), round_up(e - low))]
    n_even = int(np.ceil((last - first) / max(finest, (last - first) / (MOST_BINS + 1))))
    even = np.linspace(first, last, n_even + 1)[1:-1] if n_even > 1 else []
    new = np.unique([first, last, *(f for f in [*inner, *even] if first < f < last)])
    pairs = itertools.pairwise(new)
    return Axis(new, [_met(exact, Fraction(a) + low, Fraction(b) + high, False) for a, b in pairs])


def _met(edges: list[Fraction], lo: Fraction, hi: Fraction, closed: bool) -> tuple[int, int]:
    """First and last bin that meets [lo, hi], closed or open."""
    before, bins = operator.le if closed else operator.lt, enumerate(itertools.pairwise(edges))
    meets = [i for i, (a, b) in bins if before(a, hi) and before(lo, b)]
    return meets[0], meets[-1]


def axes_of(edges: tuple[np.ndarray, ...], executions: Executions) -> list[Axis]:
    """Bins along all axes of k. edges: of the old bins, by axis."""
    # bins as fine as the executions' box, so that few kinks of the network count in each
    coarse = 1.0
    while True:
        finest = coarse * (executions.hi - executions.lo)
        axes = [
            axis_of(e, executions.lo[i], executions.hi[i], i in executions.chosen, finest[i])
            for i, e in enumerate(edges)
        ]
        n_bins = math.prod(1 if a.edges is None else len(a.edges) - 1 for a in axes)
        if n_bins <= MOST_BINS or coarse > COARSEST:
            return axes
        coarse *= 1.25


def widest(values: np.ndarray, grid: tuple[int, ...], axes: list[Axis]) -> np.ndarray:
    """(new bins, ...) the largest of values (old bins, ...) over all old bins that are met."""
    rest = values.shape[1:]
    out = values.reshape(*grid, *rest)
    for place, axis in enumerate(axes):
        parts = [np.take(out, np.arange(a, b + 1), axis=place).max(axis=place) for a, b in axis.met]
        out = np.stack(parts, axis=place)
    return out.reshape(-1, *rest)


def boxes(axes: list[Axis], executions: Executions) -> tuple[np.ndarray, np.ndarray]:
    """Corners lo, hi (new bins, n_k) of all k in executions of a bin's plans."""
    ends = []
    for axis, low, high in zip(axes, executions.lo, executions.hi, strict=True):
        pairs = [(0.0, 0.0)] if axis.edges is None else itertools.pairwise(axis.edges)
        ends.append([(a + low, b + high) for a, b in pairs])
    both = np.array(list(itertools.product(*ends)))
    return both[:, :, 0], both[:, :, 1]
