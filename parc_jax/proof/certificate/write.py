"""Spell problems, networks, tubes, samples and polytopes as certificates: exact numbers as text,
nothing to trust.

Every float is written as the rational that it holds: those of the problem and the edges of the tube
as exact decimals, where people read them, all others in hexadecimal; multipliers are p/q.

Templates of a tube as certificates: the exact rows of their faces, and for the end, which has
too many axes for the checker to search, multipliers that give each row of a goal. [T26]
"""

from collections.abc import Iterator
from fractions import Fraction
from functools import reduce

import numpy as np
from jaxtyping import Bool

from parc_jax.checker import FORMAT
from parc_jax.checker.entries import hash_of as part_hash
from parc_jax.common.lp.exact import Basis
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.spelling import decimal_text, fraction_text, hex_text, plain
from parc_jax.learning.bound.bins import each_bin
from parc_jax.learning.bound.error_set import NO_CLAIM, Faces, Templates, at
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.predict import by_point
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.problem.body import Disc, Polygon, numbered
from parc_jax.problem.problem import Problem
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.polytopes import SafePolytope
from parc_jax.safe_set.separation.directions import longest_lasting, merged_runs
from parc_jax.safe_set.separation.inequality import at_both_knots, height, separates
from parc_jax.safe_set.verdict.scene import Scene


def rows_part(faces: Faces, index) -> dict:
    """One set of errors, a . e <= b for all rows."""
    rows = faces.rows(index)
    return {"A": fraction_text([a for a, _ in rows]), "b": fraction_text([b for _, b in rows])}


def end_part(faces: Faces, index, goal: HPolytope) -> dict:
    """The same for the end, with the ways in which rows of its frames, n directions that span, give
    each row of a goal: multipliers [[row, "m"], ...]. Row 2 j is the upper face of direction j,
    2 j + 1 the lower one.
    """
    directions = faces.directions[index]
    n_rows, n = directions.shape
    frames = []
    for first in range(0, n_rows - n_rows % n, n):
        basis = Basis(n)
        if all(basis.add([Fraction(x) for x in u]) for u in directions[first : first + n]):
            frames.append((first, basis))

    def way(a: np.ndarray, first: int, basis: Basis) -> list:
        shares = basis.coordinates([Fraction(x) for x in a])  # not None: a frame spans everything
        return [
            [2 * j + int(m < 0), fraction_text(abs(m))] for j, m in enumerate(shares, first) if m
        ]

    ways = [[way(a, *frame) for frame in frames] for a in goal.A]
    return rows_part(faces, index) | {"goal": ways}


def problem_part(problem: Problem, model: TrajectoryModel) -> dict:
    """The question."""
    pairs = zip(problem.obstacles, problem.all_spans, strict=True)
    obstacles = [_rows(o) | ({} if span is None else {"steps": list(span)}) for o, span in pairs]
    return {
        "n_p": model.n_p,
        "points": model.n_points,
        "n_q": model.n_q,
        "n_k": model.n_k,
        "domain": {"lo": decimal_text(model.domain.lo), "hi": decimal_text(model.domain.hi)},
        "goal": _rows(problem.goal),
        "obstacles": obstacles,
        "body": body_part(problem, model),
        "start": None if problem.start is None else _rows(problem.start),
        "steps": model.time.n_steps,
        "dt": decimal_text(model.time.dt),
    }


def network_part(net: ReLUNetwork) -> dict:
    """The network, float64 exactly."""
    return {
        "weights": [hex_text(W) for W in net.weights],
        "biases": [hex_text(b) for b in net.biases],
    }


def tube_part(tube: Tube) -> dict:
    """A tube of boxes, float64 exactly; a bin without claim is NO_CLAIM wide."""
    interval, final = tube.finite_widths
    return {
        "edges": [decimal_text(e) for e in tube.edges],
        "interval": hex_text(by_point(interval, tube.n_points)),
        "final": hex_text(final),
    }


def fitted_tube_part(tube: Tube, templates: Templates, goal: HPolytope) -> dict:
    """A tube of templates, exact, with bounds along a goal's rows; without claim NO_CLAIM wide."""
    during, at_end = (
        faces.with_half(np.where(np.isinf(faces.half), NO_CLAIM, faces.half)) for faces in templates
    )
    interval = [
        [[rows_part(during, (b, t, i)) for i in range(tube.n_points)] for t in range(tube.n_steps)]
        for b in range(tube.n_bins)
    ]
    return {
        "edges": [decimal_text(e) for e in tube.edges],
        "interval": interval,
        "final": [end_part(at_end, b, goal) for b in range(tube.n_bins)],
    }


def question_parts(problem: Problem, model: TrajectoryModel) -> tuple[dict, dict, dict]:
    """Problem, network and tube."""
    fitted, goal = model.tube.templates, problem.goal
    tube = tube_part(model.tube) if fitted is None else fitted_tube_part(model.tube, fitted, goal)
    return problem_part(problem, model), network_part(model.net), tube


def answer_part(
    problem: Problem,
    model: TrajectoryModel,
    samples: list[dict],
    corridors,
    polytopes,
    *,
    no_plan: dict | None,
    meta,
) -> dict:
    """The answer file. samples: their parts. meta: entries without proof, as plain values."""
    asked, network, tube = question_parts(problem, model)
    hashes = {"problem": part_hash(asked), "network": part_hash(network), "tube": part_hash(tube)}
    claim = model.claim.to_json() | {"network_hash": hashes["network"], "tube_hash": hashes["tube"]}
    hashes["claim"] = part_hash(claim := plain(claim))
    return {
        "format": FORMAT,
        "problem": asked,
        "network": network,
        "tube": tube,
        "claim": claim,
        "hash": hashes,
        "samples": samples,
        "corridors": [corridor_part(c, problem) for c in corridors],
        "sets": [polytope_part(p) for p in polytopes],
        "no_plan": no_plan,
        "meta": plain(meta) | {"hash": part_hash(plain(meta))},
    }


def separating(
    scene: Scene, tube: Tube, k: np.ndarray, path: np.ndarray
) -> Iterator[Bool[np.ndarray, "d t"]]:
    """Pair by pair which directions of the scene's table separate one plan in each interval, with
    the errors of every bin that contains it [T28]. Of an interval without a pair nothing is said.
    """
    table, errors = scene.directions, tube.during(each_bin(tube.edges, k[None])[1])
    places = np.moveaxis(by_point(path, tube.n_points), 2, 0)  # axis by axis
    for o in range(len(table.multipliers)):
        points, w = scene.obstacles.points[o], table.w[o]
        lost = at(errors, np.s_[:, :, points, None]).support(-w).max(axis=0)
        heights = height(w.T[..., None, None], places[:, None, :, points])
        threshold = table.support[o] + scene.slack * np.abs(w).sum(axis=1)
        threshold = threshold[:, None, None] + np.moveaxis(lost, 2, 0)
        yield separates(at_both_knots(heights, 1), threshold).all(axis=2)


def sample_part(scene: Scene, tube: Tube, p0: np.ndarray, k: np.ndarray, path: np.ndarray) -> dict:
    """Certificate of one safe point; path (T + 1, n_c) is its prediction."""
    table, bins = scene.directions, each_bin(tube.edges, k[None])[1]
    of_all, sep = reduce(lambda known, bin: known.wider(bin), map(tube.during, bins)), []
    for o, holds in enumerate(separating(scene, tube, k, path)):
        exists = np.flatnonzero(scene.obstacles.active[o])
        chosen = []
        for d, t in zip(longest_lasting(holds[:, exists]), exists, strict=True):
            if d >= 0:
                chosen.append(table.multipliers[o][d])
            else:  # none of the table separates: the direction of the largest gap, for all bins
                for errors in (of_all, tube.during(bins[0])):  # or for one, where no set holds all
                    gap, clearest = scene.obstacles.gap(o, path[t], path[t + 1], at(errors, t))
                    if gap > 0:
                        break
                chosen += table.nearest_of_many(o, clearest[None])
        sep.append(merged_runs(chosen, exists))
    if scene.apart is not None:
        sep = scene.apart.with_runs(sep)
    return plan_part(p0, k, sep, scene.problem)


def polytope_part(polytope: SafePolytope) -> dict:
    """Certificate of a polytope: pattern, directions and one inner point."""
    pattern = "".join("1" if on else "0" for on in polytope.pattern)
    plan = plan_part(polytope.p0, polytope.k, polytope.corridor.runs, polytope.scene.problem)
    return plan | {"bin": polytope.bin, "pattern": pattern}


def corridor_part(corridor: Corridor, problem: Problem) -> dict:
    """Certificate of a corridor: its directions and one plan that satisfies it."""
    return plan_part(corridor.p0, corridor.k, corridor.runs, problem)


def plan_part(p0: np.ndarray, k: np.ndarray, runs_by_pair: list, problem: Problem) -> dict:
    """A plan and the directions of each pair, by obstacle and by part of the body."""
    spelled = [
        [
            [run.end, [[r, fraction_text(v)] for r, v in zip(*run.multiplier, strict=True)]]
            for run in runs
        ]
        for runs in runs_by_pair
    ]
    n = len(problem.parts)
    sep = [spelled[first : first + n] for first in range(0, len(spelled), n)]
    return {"p0": hex_text(p0), "k": hex_text(k), "sep": sep}


def by_pair(sep: list) -> list:
    """The inverse: entries by obstacle and part as entries of each pair in turn."""
    return [runs for parts in sep for runs in parts]


def body_part(problem: Problem, model: TrajectoryModel) -> dict:
    """The parts of the body, by points of the model."""
    parts = numbered(problem.body, model.points)
    return {"parts": [{"points": list(part.points)} | _shape(part.shape) for part in parts]}


def _shape(shape: Disc | Polygon) -> dict:
    if isinstance(shape, Disc):
        return {"radius": decimal_text(shape.radius)}
    return {"vertices": decimal_text(shape.vertices)}


def _rows(poly) -> dict:
    return {"A": decimal_text(poly.A), "b": decimal_text(poly.b)}
