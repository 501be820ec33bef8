"""How many parameters, and how wide a network, a proof that no plan exists bears: `python -m
benchmarks.blocked`.

Bending arcs (`benchmarks/arcs.py`) in scenes where nothing fits. Times are CPU time of the second
proof in a process; the first one compiles.
"""

import time
from collections import Counter
from dataclasses import dataclass

import tyro

from benchmarks.arcs import bending_arcs
from parc_jax.common.sets.box import box
from parc_jax.problem.problem import ReachAvoid, reach_avoid
from parc_jax.proof.absence.prove_no_plan import prove_no_plan
from parc_jax.safe_set.corridors.stopping import Limit
from parc_jax.safe_set.verdict.scene import scene_of

GOAL = box([7.5, -0.8, -1.0], [8.5, 0.8, 1.0])
NETWORKS = {n_k: ((8, 8, 8, 8), (64, 64)) for n_k in (2, 4, 6, 8)}


@dataclass(frozen=True)
class Options:
    """Proofs that there is no plan."""

    budget_s: float = 60.0
    """[s] of search and check of one proof."""
    max_leaves: int = 100_000
    """Boxes of one proof."""
    n_k: tuple[int, ...] = tuple(NETWORKS)
    """Numbers of parameters."""


def scenes() -> dict[str, ReachAvoid]:
    """Where nothing fits: from the plainest on."""
    blocks = {
        "the goal inside a block": box([7.0, -1.0], [9.0, 1.0]),
        "a wall of 3 m": box([3.0, -30.0], [6.0, 30.0]),
        "a wall of 1 m": box([4.0, -30.0], [5.0, 30.0]),
    }
    return {name: reach_avoid(GOAL, [block], 0.3) for name, block in blocks.items()}


def main(options: Options) -> list[dict]:
    """Prove, and say how."""
    rows = []
    for n_k in options.n_k:
        for hidden in NETWORKS[n_k]:
            model = bending_arcs(n_k, hidden, n_steps=10)
            for name, problem in scenes().items():
                scene = scene_of(problem, model)
                prove_no_plan(scene, limit=Limit(600.0), max_leaves=1)  # compiles
                begin = time.process_time()
                found = prove_no_plan(
                    scene, limit=Limit(options.budget_s), max_leaves=options.max_leaves
                )
                seconds = time.process_time() - begin
                nodes = [] if found.certificate is None else found.certificate["tree"]
                kinds = Counter(kind for node in nodes for kind in node)
                rows.append(
                    {"n_k": n_k, "hidden": hidden, "scene": name, "kind": found.kind}
                    | {"boxes": found.leaves, "by bounds": kinds["bounded"], "CPU": seconds}
                )
                undecided = float(found.undecided / found.total)
                print(
                    f"n_k = {n_k}, {'-'.join(map(str, hidden))}, {name}: {found.kind}, "
                    f"{found.leaves} boxes, {kinds['bounded']} by bounds, {seconds:.2f} s of CPU, "
                    f"{100 * undecided:.3g} % undecided",
                    flush=True,
                )
    return rows


if __name__ == "__main__":
    main(tyro.cli(Options))
