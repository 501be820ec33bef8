"""The model of all executions at once: their points are points of one robot, and its parts are the
hulls over them. [T21, T22]

A true run is a mixture of the executions at the corners (`executions`), under a turn that is a
mixture of some maps (`turn`), plus what the mixture misses (`bend`) and the error of the model,
turned. Whatever keeps the hull of all these points clear keeps the true run clear.
"""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from parc_jax.common.sets.box import Box
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.learning.bound.claim import ErrorClaim, derived
from parc_jax.learning.bound.tube import Tube, tube
from parc_jax.learning.labels import labels as valid_labels
from parc_jax.learning.labels import name_of, unit_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import Layout
from parc_jax.learning.runs.law import Subject
from parc_jax.problem.body import Body, Part, numbered
from parc_jax.problem.problem import ReachAvoid
from parc_jax.problem.robust.bend import bend_by_bin
from parc_jax.problem.robust.bins import Axis, axes_of, boxes, widest
from parc_jax.problem.robust.executions import Executions, require_few
from parc_jax.problem.robust.network import Copied, copied
from parc_jax.problem.robust.turn import Turn

UP = 1 + 2.0**-30  # pays for the sums that make a width


def copied_model(model: TrajectoryModel, executions: Executions, turn: Turn) -> TrajectoryModel:
    """The model whose parameters are the chosen ones, and whose points are those of the model in
    every execution under every map of the turn. Raises InputError where these are too many.
    """
    n_v, n_r = len(executions.corners), len(turn.maps)
    require_few(model.n_points, n_v * n_r)
    axes = axes_of(model.tube.edges, executions)
    edges = tuple(axis.edges for axis in axes if axis.edges is not None)
    domain = Box(np.array([e[0] for e in edges]), np.array([e[-1] for e in edges]))
    one = copied(model.net, model.layout, executions, turn.maps, domain)
    wider = _tube(model, executions, turn, axes, edges, one)
    chosen = list(executions.chosen)
    named = model.labels
    several = n_v * n_r > 1
    not_drawn = [name_of(k) for axis, k in enumerate(named.k) if axis not in executions.chosen]
    subject = replace(
        model.claim.subject,
        domain=domain,
        points=_copies_of(model.points, n_v * n_r) if several else model.points,
        rotation=None if model.rotation is None else model.rotation * n_v,
        given=(),  # those that are still there are free
        labels=valid_labels(
            model.n_p,
            model.n_q * n_v,
            len(chosen),
            p=named.p,
            q=named.q if n_v == 1 else [_again(label, v) for v in range(n_v) for label in named.q],
            k=[named.k[axis] for axis in chosen],
        ),
    )
    claim = _claim(
        model.claim, wider, subject, one.net.hash, _eps(model.claim, model.tube, axes), not_drawn
    )
    return model.replace(net=one.net, claim=claim)


def copied_problem(problem: ReachAvoid, model: TrajectoryModel, n_v: int, n_r: int) -> ReachAvoid:
    """The problem about these points: hulls over all of them, and a goal that each execution under
    each map meets. model: of the robot's own points.
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
    return problem.replace(body=Body(parts), goal=every, points=points)


def _tube(
    model: TrajectoryModel,
    executions: Executions,
    turn: Turn,
    axes: list[Axis],
    edges,
    one: Copied,
) -> Tube:
    """Widths of every copy of every point: the errors of all bins that it may be in, what the
    mixture misses and what rounding does, turned.
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
    return tube(edges, during * UP, at_end * UP, m * n_v * n_r)


def _knots(values: np.ndarray, layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Outputs (b, n_out) as (b, T + 1, m, n_p), zero where the first point starts, and q."""
    start = np.zeros((len(values), layout.n_p))
    knots = np.concatenate([start, values[:, : layout.n_offsets]], axis=1)
    knots = knots.reshape(len(values), layout.n_steps + 1, layout.n_points, layout.n_p)
    return knots, values[:, layout.n_offsets :]


def _eps(claim: ErrorClaim, old: Tube, axes: list[Axis]):
    """One eps per new bin: the largest of those that its executions may be in."""
    if claim.bin_eps is None:
        return None
    known = np.array([np.inf if e is None else float(e) for e in claim.bin_eps])
    which = widest(known, old.grid, axes)
    by_value = {float(e): e for e in claim.bin_eps if e is not None}
    return tuple(by_value.get(float(e)) for e in which)


def _claim(
    claim: ErrorClaim, wider: Tube, subject: Subject, net: str, bin_eps, not_drawn: list[str]
) -> ErrorClaim:
    """The claim about the same runs, told of the executions of a plan. not_drawn: parameters that
    no plan chooses; of these the claim's law of k says nothing.
    """
    about = {"network_of_runs": claim.network, "not_drawn": not_drawn}
    if bin_eps is not None:
        about["bin_share"] = None  # of other bins than these
    return derived(claim, tube=wider, subject=subject, network=net, bin_eps=bin_eps, evidence=about)


def _copies_of(points: Sequence[str], several: int) -> tuple[str, ...]:
    """Names of all copies of points, those of one point together."""
    return tuple(f"{point} {c}" for point in points for c in range(several))


def _again(label: str, number: int) -> str:
    """The label of a goal state in one of several executions."""
    unit = unit_of(label)
    return f"{name_of(label)} {number}" + (f" [{unit}]" if unit else "")
