"""No safe plan: proved, or not found and this much undecided; and the volume bracket of the safe set. [T13-T16]

In coordinates (z, k), z = p_T = p0 + c_T(k), volumes are kept and every plan that can reach the goal lies in a box. The
box is split until each part misses the goal, starts outside the start set, or hits one obstacle in one interval with
errors inside the tube. What is returned was accepted by the independent checker, in exact arithmetic.
"""

import json
import time
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from parc_jax import checker, checker_cells
from parc_jax.certify.bracket_faces import goal_faces
from parc_jax.certify.bracket_search import Found, Search
from parc_jax.certify.bracket_tree import Node
from parc_jax.certify.certificate import network_part, problem_part, tube_part
from parc_jax.certify.scene import Scene, no_room
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid

PROVED, UNDECIDED, BRACKET = "proved", "undecided", "bracket"
CHECK_FACTOR = 1.5  # time of the checker per vertex of a cell, in evaluations of the network


class NoPlan(NamedTuple):
    """What is known of the volume of safe (p0, k) among those whose predicted end lies in the goal's box.

    kind: "proved" (none is safe), "undecided" (not proved within the budget) or "bracket". safe, unsafe, undecided,
    total: exact volumes [units of p0 and k multiplied], as the checker accepted them; without an accepted certificate
    all is undecided. certificate: the `no_plan` entry of answer.json, None when the checker refused it.
    leaves: boxes. safe_plan: (p0, k), a safe plan that the search came across, or None.
    seconds, check_seconds: search and exact check. reason: why none is safe, where a sentence can say it, else None.
    """

    kind: str
    safe: Fraction
    unsafe: Fraction
    undecided: Fraction
    total: Fraction
    certificate: dict | None
    leaves: int
    safe_plan: tuple[np.ndarray, np.ndarray] | None
    seconds: float
    check_seconds: float
    reason: str | None = None

    @property
    def certificate_bytes(self) -> int:
        """Length of the certificate as JSON text."""
        return len(json.dumps(self.certificate, separators=(",", ":")))

    def statement(self) -> str:
        """One sentence: what is true of the model and its tube."""
        if self.kind == PROVED:
            why = f"; {self.reason}" if self.reason else "; a longer search cannot find one."
            return (
                f"Proved in exact arithmetic: the model has no safe (p0, k) with this tube{why} The robot may still be "
                "able to do it: a better model or a narrower tube may tell."
            )
        safe, unsafe, share = (100 * float(v / self.total) for v in (self.safe, self.unsafe, self.undecided))
        if self.kind == BRACKET:
            return (
                f"Of the plans that end in the goal's box, by volume: at least {safe:.4g} % are safe and at least "
                f"{unsafe:.4g} % are unsafe, proved in exact arithmetic; {share:.4g} % are undecided."
            )
        why = f": {self.reason}" if self.reason else "."
        return (
            f"No safe plan was found within the budget{why} This is not a proof that none exists: of the plans that "
            f"end in the goal's box, {share:.3g} % by volume are undecided; the others are proved unsafe."
        )


def prove_no_plan(
    model: TrajectoryModel, problem: ReachAvoid, scene: Scene, *, budget_s: float, max_leaves: int,
    bracket: bool = False,
) -> NoPlan:  # fmt: skip
    """Prove that no (p0, k) is safe, or say how much is undecided; with `bracket`, also prove boxes safe.

    budget_s: [s] for search and check together; a finished proof is checked however long that takes, and
    compiling, once for scenes of a size, comes on top. max_leaves: boxes of the tree. Planar workspaces, like `scene`.
    Raises InputError for a goal without bounds on its workspace part.
    """
    context = checker.Context(problem_part(problem, model), network_part(model.net), tube_part(model.tube))
    z_lo, z_hi, faces = goal_faces(problem, model)
    root = Node(np.concatenate([z_lo, model.domain.lo]), np.concatenate([z_hi, model.domain.hi]))
    search = Search(model, problem, scene, root, bracket)
    search.compile()
    begin = time.perf_counter()
    per_vertex = CHECK_FACTOR * _seconds_per_evaluation(context, model)

    def out_of_time(exact_vertices: int) -> bool:
        return time.perf_counter() - begin + per_vertex * exact_vertices > budget_s

    found = search.run(out_of_time, max_leaves)
    searched = time.perf_counter()
    tree = found.root.spell()
    closed = not any("open" in node or "safe" in node for node in tree)
    kind = PROVED if closed else BRACKET if bracket else UNDECIDED
    plan = {
        "kind": PROVED if closed else BRACKET, "z": {"lo": _decimals(z_lo), "hi": _decimals(z_hi)}, "faces": faces,
        "tree": tree,
    }  # fmt: skip
    return _checked(context, plan, kind, found, searched - begin)._replace(reason=no_room(problem, model))


def _checked(context: checker.Context, plan: dict, kind: str, found: Found, seconds: float) -> NoPlan:
    """The verdict after the checker's; a refused certificate proves nothing and is dropped."""
    total, begin = found.root.volume, time.perf_counter()
    try:
        with checker.rejecting():
            report = checker_cells.check_no_plan(checker, context, plan)
    except checker.Rejected:
        kind, plan, report = UNDECIDED, None, {"safe": 0, "unsafe": 0, "undecided": total}
    safe, unsafe, undecided = (Fraction(report[name]) for name in ("safe", "unsafe", "undecided"))
    return NoPlan(
        kind, safe, unsafe, undecided, total, plan, found.leaves, found.safe_plan, seconds, time.perf_counter() - begin
    )


def _seconds_per_evaluation(context: checker.Context, model: TrajectoryModel) -> float:
    """How long the checker takes for one exact evaluation of the network on this machine."""
    point, scale = checker.integers([Fraction(float(v)) for v in (model.domain.lo + model.domain.hi) / 2])
    seconds = []
    for _ in range(3):
        begin = time.perf_counter()
        context.evaluate([point], scale)
        seconds.append(time.perf_counter() - begin)
    return min(seconds)


def _decimals(values) -> list[str]:
    return [repr(float(v)) for v in values]
