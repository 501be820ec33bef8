"""No safe plan: proved, or undecided up to a stated volume. [T15, T30]

Coordinates (z, k), z = p_T = p0 + c_T(k), preserve volumes, and every plan that can reach the
goal lies in a box. The box is split until each part misses the goal, starts outside the start set,
or hits one obstacle in one interval with errors inside the tube. A result was accepted by
the independent checker, in exact arithmetic.
"""

import itertools
import logging
import time
import timeit
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from parc_jax import checker
from parc_jax.common.errors import InputError
from parc_jax.common.lp.exact import Basis, round_up
from parc_jax.common.sets.hpolytope import coupled
from parc_jax.common.spelling import decimal_text, rounded_up
from parc_jax.common.status import Ended
from parc_jax.learning.bound.statement import in_box
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.problem import Problem
from parc_jax.problem.robust.realisations import Robustness
from parc_jax.proof.absence.branch_and_bound import BranchAndBound
from parc_jax.proof.absence.errors import BinErrors
from parc_jax.proof.absence.tree import Node
from parc_jax.proof.certificate.write import question_parts
from parc_jax.safe_set.corridors.stopping import Limit
from parc_jax.safe_set.verdict.infeasible import Reason, why_none
from parc_jax.safe_set.verdict.scene import Scene

_log = logging.getLogger(__name__)
PROVED = "proved"
UNDECIDED = "undecided"
KIND_IN_FILE = {PROVED: "proved", UNDECIDED: "bracket"}
MAX_LEAVES = 20_000  # a certificate has a few hundred bytes per box
IN_THE_BOX = (
    "whose first point ends in the box around the goal less the tube, whatever else the goal asks"
)
# bases of goal rows tried per face
MOST_COMBINATIONS = 50_000
CHECK_FACTOR = 1.5  # time of the checker per vertex of a cell, in evaluations of the network


class NoPlan(NamedTuple):
    """A verdict on all (p0, k) whose first point is predicted to end in a box around the goal
    less the tube; those that miss other rows of the goal are unsafe.

    kind: "proved" (none is safe) or "undecided" (not proved with this work).
    unsafe, undecided, total: exact volumes [units of p0 and k multiplied], as the checker accepted
        them; without an accepted certificate all is undecided.
    certificate: the `no_plan` entry of answer.json, None when the checker refused it.
    leaves: boxes. safe_plan: (p0, k), a safe plan that the search came across, or None.
    seconds: [s] of the search.
    reason: why none is safe, where a sentence can say it, else None. uncertainty: that a safe
        plan would be robust to, None for none. ended: the cause, None if unknown. box: of all k.
    """

    kind: str
    unsafe: Fraction
    undecided: Fraction
    total: Fraction
    certificate: dict | None = None
    leaves: int = 1
    safe_plan: tuple[np.ndarray, np.ndarray] | None = None
    seconds: float = 0.0
    reason: Reason | None = None
    uncertainty: Robustness | None = None
    ended: Ended | None = Ended.TARGET
    box: str = "K"

    def details(self) -> str:
        """The sentence about the model and its tube, and the plans that it is about."""
        told = self._told()
        return told if self.uncertainty is None else f"{told} {self.uncertainty.meaning}"

    def _told(self) -> str:
        if self.kind == PROVED:
            told = f"Proved in exact arithmetic: the model has no safe (p0, k){in_box(self.box)} "
            told += "with this tube; a longer search cannot find one."
            told += f" Why, as float64 has it: {self.reason.words}" if self.reason else ""
            may = " The robot may still be able to do it: a better model, a narrower tube, or "
            may += "obstacles told less coarsely, may tell."
            return told if self.reason and self.reason.of_scene else f"{told}{may}"
        if self.reason is not None and self.reason.sure:
            return f"No plan is safe: {self.reason.words}"
        why = f": {self.reason.words}" if self.reason else "."
        share = rounded_up(100 * self.undecided / self.total, 4)
        return (
            f"No safe plan was found{why} This is not a proof that none exists: of the plans"
            f"{in_box(self.box)} {IN_THE_BOX}, {share} % by volume are undecided; the others are "
            "proved unsafe."
        )


def prove_no_plan(scene: Scene, *, limit: Limit, max_leaves: int) -> NoPlan:
    """Prove that no (p0, k) is safe, or say how much is undecided.

    max_leaves: boxes of the tree, the work. limit: above it, for search and check together, which
    the answer reports when it cuts off; it counts from here, if not from earlier on. A full proof
    is checked however long that takes, and compiling, once for scenes of a size, comes on top.
    With more parameters than the checker takes, a tube that leaves out the model itself, or a limit
    that is over, nothing is searched, and all is undecided.
    Raises InputError for a goal without bounds on the end of the first point.
    """
    model = scene.model
    z_lo, z_hi, faces = goal_faces(scene.problem, model)
    root = Node(np.concatenate([z_lo, model.domain.lo]), np.concatenate([z_hi, model.domain.hi]))
    if (missing := _missing(model)) is not None:
        return _not_searched(root, missing, why_none(scene))
    if limit.over():
        none = _not_searched(root, "seconds, of which none were left", why_none(scene))
        return none._replace(ended=Ended.SECONDS)
    question = question_parts(scene.problem, model)
    context = checker.Context(*question)
    search = BranchAndBound(scene, root)
    _log.info("compiling for a proof that there is no plan")
    with limit.uncounted():
        search.compile()
    begin = time.perf_counter()
    per_vertex = CHECK_FACTOR * _seconds_per_evaluation(context, model)
    limit.start()
    search.run(lambda vertices: limit.over(per_vertex * vertices), max_leaves)
    searched = time.perf_counter()
    ended = Ended.SECONDS if limit.cut else Ended.TARGET if search.decided else Ended.WORK
    tree = root.spell()
    kind = UNDECIDED if any("open" in node for node in tree) else PROVED
    z = {"lo": decimal_text(z_lo), "hi": decimal_text(z_hi)}
    plan: dict | None = {"kind": KIND_IN_FILE[kind], "z": z, "faces": faces, "tree": tree}
    _log.info("checking a proof of %d boxes in exact arithmetic", search.leaves)
    context.work_left = checker.allowance(*question, plan)  # as for the file that will hold it
    try:
        with checker.rejecting():
            report = checker.check_no_plan(context, plan)
    except checker.Rejected:  # a refused certificate proves nothing and is dropped
        kind, plan, ended = UNDECIDED, None, None
        report = {"unsafe": 0, "undecided": root.volume}
    return NoPlan(
        kind,
        unsafe=Fraction(report["unsafe"]),
        undecided=Fraction(report["undecided"]),
        total=root.volume,
        certificate=plan,
        leaves=search.leaves,
        safe_plan=search.safe_plan,
        seconds=searched - begin,
        reason=why_none(scene),
        ended=ended,
    )


def _missing(model: TrajectoryModel) -> str | None:
    """A requirement of the search that a model does not meet, in words."""
    most = checker.MAX_PARAMETERS
    if model.n_k > most:
        return f"a model with at most {most} parameters; this model has {model.n_k}"
    if not model.tube.claimed.any():
        return f"a claim about some bin of {model.claim.law.box}; this model has none"
    if not all(faces.allow_none.all() for faces in model.tube.templates or ()):
        return "a tube around the model itself; in a bin of this one no error at all is outside"
    return None


def _not_searched(root: Node, needed: str, reason: Reason | None) -> NoPlan:
    """All plans undecided."""
    why, all_of = reason or Reason(f"a proof needs {needed}.", False), root.volume
    return NoPlan(UNDECIDED, Fraction(0), all_of, all_of, reason=why, ended=None)


def _seconds_per_evaluation(context: checker.Context, model: TrajectoryModel) -> float:
    """How long the checker takes for one exact evaluation of the network on this machine."""
    middle = (model.domain.lo + model.domain.hi) / 2
    point, scale = checker.integers([Fraction(float(v)) for v in middle])
    return min(timeit.repeat(lambda: context.evaluate([point], scale), repeat=3, number=1))


def goal_faces(problem: Problem, model: TrajectoryModel) -> tuple[np.ndarray, np.ndarray, list]:
    """Box lo, hi (n_p,) of z and the certificate's `faces`, from the goal shrunken by errors at the
    end that all bins allow.

    Exact: the combination of goal rows is the axis direction, the bound is rounded outward. Where
    the goal leaves no room at all the box is opened up, so that it has a volume; every plan in it
    then misses the goal.
    """
    tube = model.tube
    known = BinErrors(tube, problem.goal.A)
    errors = known.at_end(np.arange(tube.n_bins))
    rows = [[Fraction(v) for v in row] for row in problem.goal.A]
    bounds = []
    for row, end, error in zip(rows, problem.goal.b, errors, strict=True):
        lost = sum(a * Fraction(float(e)) for a, e in zip(row, error, strict=True))
        bounds.append(Fraction(end) - lost)
    lo, hi = np.zeros(model.n_p), np.zeros(model.n_p)
    faces = []
    for axis in range(model.n_p):
        pair = []
        for sign, side in ((-1, lo), (1, hi)):
            h, used = _tightest(rows, bounds, axis, sign)
            side[axis] = sign * round_up(h)
            pair.append([known.goal_entry(errors, row, m) for row, m in used])
        faces.append(pair)
        if not lo[axis] < hi[axis]:
            lo[axis], hi[axis] = hi[axis] - 1.0, lo[axis] + 1.0
    return np.nextafter(lo, -np.inf), np.nextafter(hi, np.inf), faces


def _tightest(
    rows: list[list[Fraction]], bounds: Sequence[Fraction], axis: int, sign: int
) -> tuple[Fraction, list[tuple[int, Fraction]]]:
    """Least bound h and multipliers, sum m row = sign * unit vector, of single rows, else bases."""
    found = []
    for i, row in enumerate(rows):  # rows along the axis; combinations only where there are none
        if row[axis] * sign > 0 and sum(v != 0 for v in row) == 1:
            found.append((bounds[i] / abs(row[axis]), [(i, 1 / abs(row[axis]))]))
    if not found:
        columns, tied = coupled(np.array(rows), axis)
        target = [Fraction(sign * (j == axis)) for j in columns]
        choices = itertools.combinations(tied, len(columns))
        for used in itertools.islice(choices, MOST_COMBINATIONS):
            basis = Basis(len(target))
            independent = all(basis.add([rows[i][j] for j in columns]) for i in used)
            m = basis.coordinates(target) if independent else None
            if m is not None and min(m) >= 0:
                pairs = [(i, v) for i, v in zip(used, m, strict=True) if v > 0]
                found.append((sum(v * bounds[i] for i, v in pairs), pairs))
    if not found:
        raise InputError(
            f"goal: expected rows that bound axis {axis}; none of their combinations does. Add a "
            "row."
        )
    return min(found, key=lambda pair: pair[0])
