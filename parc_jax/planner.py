"""The planner: one model, any number of queries."""

import time
from functools import cached_property

import jax
import numpy as np

from parc_jax.answer import LEVELS, Answer
from parc_jax.avoid.paper import paper_search
from parc_jax.avoid.paper_scene import paper_scene
from parc_jax.certify.batch import BatchAnswer, Problems, problem_of, solve_batch
from parc_jax.certify.certificate import sample_part
from parc_jax.certify.cover import Cover, cover, nothing_covered
from parc_jax.certify.draw import generator, points
from parc_jax.certify.evaluate import evaluate
from parc_jax.certify.first import first_look
from parc_jax.certify.grower import Grower
from parc_jax.certify.no_plan import NoPlan, prove_no_plan
from parc_jax.certify.pieces import Pieces
from parc_jax.certify.probes import require_sound_arithmetic
from parc_jax.certify.prove import prove
from parc_jax.certify.scene import Scene, scene
from parc_jax.errors import InputError
from parc_jax.keys import Stage, stream
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid
from parc_jax.pwa import RegionTable, enumerate_regions
from parc_jax.reach.pieces import pieces_outward

MAX_LEAVES = 20_000  # boxes of a branch and bound; a certificate has a few hundred bytes per box
METHODS = {"exact": None, "paper": "supports", "paper-lp": "lp"}


class Planner:
    """Answers reach-avoid queries about one model.

    model: network, claim, domain and time grid of the system.
    """

    def __init__(self, model: TrajectoryModel):
        self.model = model

    @cached_property
    def regions(self) -> RegionTable:
        """All regions of the network over K, enumerated once."""
        return enumerate_regions(self.model.net, self.model.domain)

    def solve(
        self, problem: ReachAvoid, key: jax.Array, *, n_samples: int = 100, target: float = 0.01,
        confidence: float = 0.99, budget_s: float = 20.0, polytopes: bool = True, proof: bool = True,
        method: str = "exact", no_plan_budget_s: float = 5.0,
    ) -> Answer:  # fmt: skip
        """The safe set of one problem, as samples, corridors and polytopes with certificates. Uses the SEARCH stream of
        `key`.

        n_samples: safe plans to return. target, confidence: the polytopes leave out at most `target` of the model's
        safe set, with this confidence, unless budget_s [s] ends first; 0 grows none, for samples only. polytopes: False
        stops as soon as the corridors leave out so little, which is several times earlier, and returns no polytopes.
        proof: check all of it in exact arithmetic. method: "exact"; or the published search, samples only, region by
        region: "paper" through supports, "paper-lp" with its LPs. no_plan_budget_s: [s] for a proof that there is no
        safe plan, spent only when none was drawn.
        Raises InputError when the problem does not fit the model, SoundnessError when this installation
        computes wrong numbers.
        """
        if not 0 < target < 1 or not 0 < confidence < 1:
            raise InputError(f"solve: expected target and confidence between 0 and 1; got {target}, {confidence}.")
        if n_samples < 1:
            raise InputError(f"solve: expected n_samples >= 1; got {n_samples}.")
        if method not in METHODS:
            raise InputError(f"solve: expected method {', '.join(METHODS)}; got {method!r}.")
        require_sound_arithmetic()
        begin = time.perf_counter()
        rng = generator(stream(key, Stage.SEARCH))
        laid_out = scene(problem, self.model)
        if method == "exact" and budget_s <= 0:
            found = first_look(self.model, laid_out, rng, n_samples, confidence)
        elif method == "exact":
            found = cover(
                self.model, problem, laid_out, rng, target=target, confidence=confidence, budget_s=budget_s,
                polytopes=polytopes,
            )  # fmt: skip
        else:
            found = self._published(problem, laid_out, stream(key, Stage.SEARCH), METHODS[method], confidence)
        no_plan = None
        if method == "exact" and not len(found.points.k):
            no_plan, found = self._search_on(problem, laid_out, rng, found, no_plan_budget_s)
        covered = time.perf_counter()
        pick = rng.permutation(len(found.points.k))[:n_samples]
        parts = [
            sample_part(problem, laid_out, self.model.tube, p.p0, p.k, p.path, int(p.bin))
            for p in (found.points.at(i) for i in pick)
        ]
        samples = np.concatenate([found.points.p0[pick], found.points.k[pick]], axis=1)
        level, refused = LEVELS[0], 0
        if proof:
            accepted = prove(problem, self.model, parts, found.corridors, found.pieces)
            level, refused = LEVELS[1], sum(int((~kept).sum()) for kept in accepted)
            samples, parts = samples[accepted[0]], _those(parts, accepted[0])
            found = _without_refused(found, *accepted[1:])
        timings = {
            "first_sample_s": found.first_sample_s, "first_piece_s": found.first_piece_s,
            "corridors_s": found.corridors_s, "cover_s": covered - begin, "proof_s": time.perf_counter() - covered,
        }  # fmt: skip
        return Answer(self.model, problem, laid_out, found, samples, parts, level, refused, timings, no_plan)

    def solve_batch(
        self, problems: Problems, key: jax.Array, *, n_samples: int = 4, draws: int = 4096, pool: int = 1024,
        numbers=None, warm=None, proof: bool = False, polytopes=(), budget_s: float = 5.0, mesh=None,
    ) -> BatchAnswer:  # fmt: skip
        """Safe plans for many problems in a few compiled calls. Uses the SEARCH stream of `key`.

        problems: a list, `box_scenes` (no cost per scene in Python), or stacked scene arrays. n_samples: safe plans per
        problem. draws: most plans to propose per problem; solved ones stop early. pool: values of k shared by all.
        numbers: (s,) the problems' own numbers, by default 0, 1, ...: with the key they decide an answer, so it does
        not depend on what else is in the batch. warm: an earlier BatchAnswer of the same problems, or plans.
        proof: exact check of every best plan, some ten milliseconds each. polytopes: rows that `solve` answers as
        well, budget_s [s] each. mesh: devices to spread over (`distributed.mesh`). Raises as `solve` does.
        """
        require_sound_arithmetic()
        chosen = {int(i): problem_of(problems, i) for i in polytopes}
        answer = solve_batch(
            self.model, problems, key, n_samples=n_samples, draws=draws, pool=pool, numbers=numbers, warm=warm,
            proof=proof, mesh=mesh,
        )  # fmt: skip
        return answer._replace(answers={i: self.solve(p, key, budget_s=budget_s) for i, p in chosen.items()})

    def bracket(self, problem: ReachAvoid, *, budget_s: float = 20.0, max_leaves: int = MAX_LEAVES) -> NoPlan:
        """Exact bounds on the volume of safe (p0, k): safe <= volume <= total - unsafe. [T14]

        budget_s: [s] for search and exact check. max_leaves: boxes. Raises as `solve` does.
        """
        require_sound_arithmetic()
        laid_out = scene(problem, self.model)
        return prove_no_plan(self.model, problem, laid_out, budget_s=budget_s, max_leaves=max_leaves, bracket=True)

    def _search_on(self, problem: ReachAvoid, laid_out: Scene, rng, found: Cover, budget_s: float):
        """Branch and bound after no draw was safe: the proof, or pieces around a plan that it came across."""
        begin, model = time.perf_counter(), self.model
        no_plan = prove_no_plan(model, problem, laid_out, budget_s=budget_s, max_leaves=MAX_LEAVES)
        if no_plan.safe_plan is None:
            return no_plan, found
        p0, k = (x[None] for x in no_plan.safe_plan)
        seen = points(p0, k, evaluate(model, laid_out, p0, k))
        pieces = Pieces(Grower(model, problem, laid_out, rng))
        pieces.grower.keep(seen)
        for _ in pieces.grower.grow(few=True):
            pass
        pieces.add(seen)
        return no_plan, found._replace(
            points=seen, corridors=pieces.corridors.all, pieces=pieces.all(), first_sample_s=no_plan.seconds,
            first_piece_s=time.perf_counter() - begin,
        )  # fmt: skip

    def _published(self, problem: ReachAvoid, laid_out: Scene, key, method: str, confidence: float) -> Cover:
        """Samples of the published search from the middle of K outward, as a cover without polytopes."""
        begin, model = time.perf_counter(), self.model
        regions = pieces_outward(self.regions, model.tube, model.domain.center)
        found = paper_search(key, regions, paper_scene(problem, model.tube), method=method).samples
        p0, k = found[:, : model.n_p], found[:, model.n_p :]
        e = evaluate(model, laid_out, p0, k)
        seen = points(p0, k, e).at(e.safe)
        first = time.perf_counter() - begin if len(seen.k) else None
        counts, none = (len(found), len(found), len(seen.k)), nothing_covered(confidence)
        return Cover(*counts, float("nan"), seen, none, none, first_sample_s=first)


def _those(parts, accepted) -> list:
    return [part for part, keep in zip(parts, accepted, strict=True) if keep]


def _without_refused(found: Cover, corridors: np.ndarray, pieces: np.ndarray) -> Cover:
    """The accepted ones. Where any was refused, the looks judged more than is returned, and nothing is stated of it."""
    kept = found.kept if corridors.all() else found.kept._replace(at_least=0.0)
    coverage = found.coverage if pieces.all() else found.coverage._replace(at_least=0.0)
    return found._replace(
        corridors=_those(found.corridors, corridors), pieces=_those(found.pieces, pieces), kept=kept, coverage=coverage
    )
