"""No safe plan: proved, or not found and this much undecided. [T15, T30]

In coordinates (z, k), z = p_T = p0 + c_T(k), volumes are kept and every plan that can reach the
goal lies in a box. The box is split until each part misses the goal, starts outside the start set,
or hits one obstacle in one interval with errors inside the tube. What is returned was accepted by
the independent checker, in exact arithmetic.
"""

import time
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from parc_jax import checker
from parc_jax.common.spelling import decimal_text, rounded_up
from parc_jax.common.status import Ended
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.robust.realisations import Robustness
from parc_jax.proof.absence.branch_and_bound import BranchAndBound
from parc_jax.proof.absence.faces import goal_faces
from parc_jax.proof.absence.tree import Node
from parc_jax.proof.certificate.write import question_parts
from parc_jax.safe_set.corridors.stopping import Limit
from parc_jax.safe_set.verdict.infeasible import Reason, why_none
from parc_jax.safe_set.verdict.scene import Scene

PROVED = "proved"
UNDECIDED = "undecided"
KIND_IN_FILE = {PROVED: "proved", UNDECIDED: "bracket"}
MAX_LEAVES = 20_000  # a certificate has a few hundred bytes per box
IN_THE_BOX = (
    "whose first point ends in the box around the goal less the tube, whatever else the goal asks"
)
CHECK_FACTOR = 1.5  # time of the checker per vertex of a cell, in evaluations of the network


class NoPlan(NamedTuple):
    """What is known of the (p0, k) whose first point is predicted to end in a box around the goal
    less the tube; those that miss what else the goal asks are unsafe.

    kind: "proved" (none is safe) or "undecided" (not proved with this work).
    unsafe, undecided, total: exact volumes [units of p0 and k multiplied], as the checker accepted
        them; without an accepted certificate all is undecided.
    certificate: the `no_plan` entry of answer.json, None when the checker refused it.
    leaves: boxes. safe_plan: (p0, k), a safe plan that the search came across, or None.
    seconds: [s] of the search.
    reason: why none is safe, where a sentence can say it, else None. uncertainty: what a safe plan
        here withstands; None where there was no uncertainty. ended: by what, None if not known.
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

    def details(self) -> str:
        """The sentence about the model and its tube, and the plans that it is about."""
        told = self._told()
        return told if self.uncertainty is None else self.uncertainty.of_none(told)

    def _told(self) -> str:
        if self.kind == PROVED:
            why = f"; {self.reason.words}" if self.reason else "; a longer search cannot find one."
            told = f"Proved in exact arithmetic: the model has no safe (p0, k) with this tube{why}"
            if self.reason is not None and self.reason.of_scene:
                return told
            return (
                f"{told} "
                "The robot may still be able to do it: a better model or a narrower tube may tell."
            )
        if self.reason is not None and self.reason.sure:
            return f"No plan is safe: {self.reason.words}"
        why = f": {self.reason.words}" if self.reason else "."
        share = rounded_up(100 * self.undecided / self.total, 4)
        return (
            f"No safe plan was found{why} This is not a proof that none exists: "
            f"of the plans {IN_THE_BOX}, {share} % by volume are undecided; the "
            f"others are proved unsafe.{self._ended}"
        )

    @property
    def _ended(self) -> str:
        return "" if self.ended in (None, Ended.TARGET) else f" {self.ended.sentence}"


def prove_no_plan(scene: Scene, *, limit: Limit, max_leaves: int) -> NoPlan:
    """Prove that no (p0, k) is safe, or say how much is undecided.

    max_leaves: boxes of the tree, the work. limit: above it, for search and check together, which
    the answer tells when it cuts off; it counts from here, if not from earlier on. A finished proof
    is checked however long that takes, and compiling, once for scenes of a size, comes on top.
    With more parameters than the checker takes, a tube that leaves out the model itself, or a limit
    that is over, nothing is searched, and all is undecided.
    Raises InputError for a goal without bounds on the end of the first point.
    """
    model = scene.model
    z_lo, z_hi, faces = goal_faces(scene.problem, model)
    root = Node(np.concatenate([z_lo, model.domain.lo]), np.concatenate([z_hi, model.domain.hi]))
    missing = _missing(model)
    if missing is not None:
        return _not_searched(root, missing, why_none(scene))
    if limit.over():
        none = _not_searched(root, "seconds, of which none were left", why_none(scene))
        return none._replace(ended=Ended.SECONDS)
    question = question_parts(scene.problem, model)
    context = checker.Context(*question)
    search = BranchAndBound(scene, root)
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
    plan: dict | None = {
        "kind": KIND_IN_FILE[kind],
        "z": {"lo": decimal_text(z_lo), "hi": decimal_text(z_hi)},
        "faces": faces,
        "tree": tree,
    }
    context.work_left = checker.allowance(*question, plan)  # as for the file that will hold it
    try:
        with checker.rejecting():
            report = checker.check_no_plan(context, plan)
    except checker.Rejected:  # a refused certificate proves nothing and is dropped
        kind, plan, report = UNDECIDED, None, {"unsafe": 0, "undecided": root.volume}
    return NoPlan(
        kind=kind,
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
    """What a search would need that a model does not have."""
    most = checker.MAX_PARAMETERS
    if model.n_k > most:
        return f"a model with at most {most} parameters; this model has {model.n_k}"
    if not model.tube.claimed.any():
        return "a claim about some bin of K; this model has none"
    templates = model.tube.templates or ()
    if not all(faces.allow_none.all() for faces in templates):
        return "a tube around the model itself; in a bin of this one no error at all is outside"
    return None


def _not_searched(root: Node, needed: str, reason: Reason | None) -> NoPlan:
    """Nothing is known of any plan."""
    return NoPlan(
        kind=UNDECIDED,
        unsafe=Fraction(0),
        undecided=root.volume,
        total=root.volume,
        reason=reason or Reason(f"a proof needs {needed}.", False),
        ended=None,
    )


def _seconds_per_evaluation(context: checker.Context, model: TrajectoryModel) -> float:
    """How long the checker takes for one exact evaluation of the network on this machine."""
    point, scale = checker.integers(
        [Fraction(float(v)) for v in (model.domain.lo + model.domain.hi) / 2]
    )
    seconds = []
    for _ in range(3):
        begin = time.perf_counter()
        context.evaluate([point], scale)
        seconds.append(time.perf_counter() - begin)
    return min(seconds)
