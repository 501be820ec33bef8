"""The planner: one model, any number of queries: one alone, many at once, or one prepared."""

import logging
import time
from collections.abc import Sequence
from itertools import compress
from typing import TYPE_CHECKING, NamedTuple

import jax
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.common.errors import InputError, check_count, expected, reading
from parc_jax.common.keys import Stage, as_key, key_of, stream
from parc_jax.common.probes import require_sound_arithmetic
from parc_jax.common.status import Ended
from parc_jax.learning.bound.statement import UNSHOWN
from parc_jax.learning.model import TrajectoryModel, check_model
from parc_jax.method import Exact, FirstProved
from parc_jax.problem.problem import Problem
from parc_jax.problem.robust.nominal import NominalProblem, nominal_problems, query
from parc_jax.problem.world.moving import require_under_way
from parc_jax.proof.absence.prove_no_plan import NoPlan
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import sample_part
from parc_jax.proof.regions import RegionTable, regions_of
from parc_jax.safe_set.batch.box_scenes import BoxScenes
from parc_jax.safe_set.batch.search import BatchAnswer, Problems, problem_of, search_batch
from parc_jax.safe_set.corridors.first import MOST, first_safe
from parc_jax.safe_set.corridors.search import Cover
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.pointwise import paths_of
from parc_jax.safe_set.verdict.scene import Scene, pruned_scene, volume_of_all
from parc_jax.statement import told_under

if TYPE_CHECKING:
    from parc_jax.drive.local.validation import Validate

WHOLE = Settings.whole()
COLD_WORK = 0.03  # two looks, with corridors between: `warm_up` wants the compiled programs alone

_log = logging.getLogger(__name__)


class FirstPlans(NamedTuple):
    """Safe plans in the order of their draws: uniform over the safe set, each verified in float64
    with the margin that covers rounding. An empty array does not say that there are none.

    plans: (n, n_p + n_k).
    clearance: (n,) [m] from every obstacle, of every run inside the tube.
    drawn: number of plans that were tested. under: as of `BatchAnswer`.
    """

    plans: np.ndarray
    clearance: np.ndarray
    drawn: int
    under: str = ""

    def __repr__(self) -> str:
        return f"<FirstPlans: {len(self.plans)} safe of {self.drawn} drawn{self.under}>"


class Prepared:
    """A problem lowered to arrays for one model. Made by `Planner.prepare`."""

    def __init__(self, scene: Scene):
        self.scene = scene

    def __repr__(self) -> str:
        return f"Prepared({self.scene.problem!r})"

    def first(self, key: jax.Array, n: int = 1) -> FirstPlans:
        """The first n safe plans of a few draws, in one compiled call: fewer, or none, where safe
        plans are rarer than about one in a hundred; `solve` searches on.

        key: its SEARCH stream is used. n: at most 16. Raises as `solve` does.
        """
        check_count("first", n, 1, "1")
        if n > MOST:
            raise InputError(f"first: expected 1 to {MOST} plans; got {n}. `solve` gives more.")
        require_under_way(self.scene.problem.all_spans)
        require_sound_arithmetic()
        safe, _ = first_safe(self.scene, stream(key, Stage.SEARCH), n)
        return FirstPlans(safe.plans, safe.clearance, safe.judged, told_under(self.scene))

    def solve(self, key: jax.Array, settings: Settings | None = None) -> Answer:
        """The answer that `Planner.solve` gives. Raises as that does."""
        settings, begin = _settings("solve", settings), time.perf_counter()
        require_under_way(self.scene.problem.all_spans)
        method = settings.method or Exact()
        if not isinstance(method, FirstProved):  # of which floats decide nothing
            require_sound_arithmetic()
        cover, no_plan = method.search(self.scene, stream(key, Stage.SEARCH), settings)
        return answered(self.scene, cover, no_plan, settings, begin)


def answered(
    scene: Scene, cover: Cover, no_plan: NoPlan | None, settings: Settings, begin: float
) -> Answer:
    """The answer of a search that began at `begin` [s], less what the exact checker refuses."""
    covered = time.perf_counter()
    told = covered - begin, cover.safe, len(cover.corridors)
    _log.info("searched for %.1f s: %d safe points, %d corridors", *told)
    chosen = cover.points
    samples = np.concatenate([chosen.p0, chosen.k], axis=1)

    def certificates() -> list[dict]:
        plans = zip(chosen.p0, chosen.k, chosen.path, strict=True)
        return [sample_part(scene, scene.model.tube, *plan_and_path) for plan_and_path in plans]

    written = certificates
    if settings.proof:
        parts, n = certificates(), len(cover.corridors)
        _log.info("checking %d plans and %d corridors in exact arithmetic", len(parts), n)
        accepted, held, _ = prove(scene.problem, scene.model, parts, cover.corridors)
        refused = int((~accepted).sum() + (~held).sum())
        samples, written = samples[accepted], list(compress(parts, accepted))
        if not held.all():  # coverage was counted with the refused corridors: nothing is stated
            cover = cover._replace(coverage=cover.coverage._replace(share=0.0, at_least=0.0))
        corridors = tuple(compress(cover.corridors, held))
        cover = cover._replace(corridors=corridors, proved=True, refused=refused)
        took = time.perf_counter() - covered
        _log.info("proved in exact arithmetic for %.1f s: %d refused", took, refused)
    spent = {**cover.timings, "cover_s": covered - begin, "proof_s": time.perf_counter() - covered}
    found, ended = len(samples) + len(cover.corridors) > 0, cover.ended
    if no_plan is not None:
        doubt, box = scene.nominal.uncertainty, scene.model.claim.law.box
        no_plan = no_plan._replace(uncertainty=doubt, box=box)
        # a limit in seconds is told wherever it cut work off; else the end of what was decisive
        if no_plan.ended is not None and ended != Ended.SECONDS:
            ended = ended if found and no_plan.ended != Ended.SECONDS else no_plan.ended
    cover = cover._replace(ended=ended, total_volume=volume_of_all(scene), timings=spent)
    return Answer(scene, cover, samples, written, no_plan)


class Planner:
    """Answers reach-avoid queries about one model.

    model: network and claim. Raises InputError for anything else, and for a claim about another
    network, or with a part of another claim.
    """

    def __init__(self, model: TrajectoryModel):
        if not isinstance(model, TrajectoryModel):
            raise InputError(expected("Planner", "a TrajectoryModel", model, "pj.load(path)"))
        check_model(model)
        self.model = model
        self._robust_models: dict[tuple, TrajectoryModel] = {}

    def __repr__(self) -> str:
        return f"Planner({self.model!r})"

    @property
    def regions(self) -> RegionTable:
        """All regions of the network over K, enumerated once."""
        return regions_of(self.model)

    def solve(
        self,
        problem: Problem,
        key: jax.Array,
        settings: Settings | None = None,
        *,
        at=None,
        validate: "Validate | None" = None,
    ) -> Answer:
        """The safe set of one problem: samples and corridors, with certificates.

        problem: from `reach_avoid` or `load_problem`; all plans of the answer are robust to its
            uncertainty.
        key: from `jax.random`; its SEARCH stream is used.
        settings: sizes, work and method; by default `Settings.whole()`.
        at: pose of the robot, x, y or x, y, heading, for plans from there: sets in k alone; with a
            heading, for which a system declares `rotation`, in the robot's frame; turns count, as
            those of the goal.
        validate: test nested sets of plans by fresh runs in this scene; `Answer.validation` has the
            largest that shows the given risk. By default by the recordings that a model of a
            log keeps, where no risk of a drawn plan is stated, or one above 0.15. [T42]
        Raises InputError when the problem does not fit the model, SoundnessError when this
        installation computes wrong numbers.
        """
        as_key(key)
        settings = _settings("solve", settings)
        if validate is not None and settings.samples_only:
            raise InputError("validate: expected settings of sets; got samples_only. Leave it out.")
        answer = self.prepare(problem, at=at).solve(key, settings)
        if validate is None and (self.model.held is None or settings.samples_only):
            return answer
        # imported late: queries alone run no system
        from parc_jax.drive.local.validate import validated

        return validated(answer, key, settings, validate)

    def prepare(self, problem: Problem, *, at=None) -> Prepared:
        """The problem lowered for this model, for many queries: safe plans from one compiled call
        each, or full answers.

        problem, at: as of `solve`. Raises as `solve` does.
        """
        if not isinstance(problem, Problem):
            how = "pj.exchange.load_problem(path) reads a scene file, pj.reach_avoid(...) makes one"
            raise InputError(expected("Planner", "a problem", problem, how))
        return Prepared(pruned_scene(query(problem, self.model, at).nominal(self._robust_models)))

    def warm_up(
        self, problem: Problem, settings: Settings | None = None, *, at=None, proof: bool = False
    ) -> Answer:
        """Compile the programs of a query of this size, so that the times of the next `solve` are
        those of a search.

        Returns the answer of a query with next to no work, from a separate random stream: its plans
        are safe, and proved with `proof`, but cover little.
        """
        settings = _settings("warm_up", settings)
        cold = settings.replace(work=min(settings.work, COLD_WORK), proof=proof)
        return self.prepare(problem, at=at).solve(stream(key_of(0), Stage.SEARCH), cold)

    def solve_batch(
        self,
        problems: Problems,
        key: jax.Array,
        settings: Settings | None = None,
        *,
        draws: int = 4096,
        numbers=None,
        warm=None,
        whole: Sequence[int] = (),
        mesh=None,
    ) -> BatchAnswer:
        """Safe plans for many problems in a few compiled calls. Uses the SEARCH stream of `key`.

        problems: a list, or `box_scenes` (no cost per scene in Python). A list may be under
            uncertainty, the same for all but for goal and obstacles.
        settings: by default `Settings.fast()`; of its fields samples (safe plans per problem) and
            proof (exact check of every best plan, some ten milliseconds each) count here.
        draws: most plans to propose per problem; solved ones stop early.
        numbers: (s,) a number per problem, by default 0, 1, ...: with the key it decides an answer,
            which so does not depend on the rest of the batch.
        warm: an earlier BatchAnswer of the same problems, or plans.
        whole: rows that `solve` answers as well, with these settings, or with `Settings.whole()`
            where these are for samples only.
        mesh: devices to spread over (`common.backend.mesh`).
        Raises as `solve` does.
        """
        settings = _settings("solve_batch", Settings.fast() if settings is None else settings)
        if isinstance(problems, Problem):
            raise InputError("solve_batch: expected several problems; got one. Use `solve`.")
        check_count("solve_batch: draws", draws, 1, "4096")
        as_key(key)
        require_sound_arithmetic()
        with reading("solve_batch whole", "rows of the problems"):
            chosen = {int(i): problem_of(problems, i) for i in whole}
        model, under = self.model, UNSHOWN.get(self.model.claim.kind, "")
        if not isinstance(problems, BoxScenes):
            asked = nominal_problems(problems, model, self._robust_models)
            problems, model = [one.problem for one in asked], asked[0].model if asked else model
            under += " for all that is uncertain" * any(one.uncertainty for one in asked)
            spans = [span for one in problems for span in one.all_spans if span is not None]
            under += " for a begin at the moment of each" * any(x.at is not None for x in spans)
        begin = time.perf_counter()
        best, draws, seconds = search_batch(
            model, problems, key, settings.samples, draws, numbers, warm, mesh
        )
        found = best.clearance[:, 0] > 0
        searched = time.perf_counter()
        proved = _proved(model, problems, best.plans[:, 0], found) if settings.proof else None
        seconds = {
            "layout": seconds,
            "search": searched - begin - seconds,
            "proof": time.perf_counter() - searched,
        }
        each = Settings.whole() if settings.samples_only else settings
        answers = {i: self.solve(p, key, each) for i, p in chosen.items()}
        of = draws, proved, seconds, answers, under
        return BatchAnswer(found, best.plans, best.clearance, *of)


def _settings(call: str, settings) -> Settings:
    if settings is not None and not isinstance(settings, Settings):
        hint = "pj.Settings(samples=10) or pj.Settings.fast()"
        raise InputError(expected(call, "Settings", settings, hint))
    return WHOLE if settings is None else settings


def _proved(
    model: TrajectoryModel, problems: Problems, plans: np.ndarray, found: np.ndarray
) -> np.ndarray:
    """(s,) bool: the independent checker accepts the best plan, in exact arithmetic."""
    out = np.zeros(len(found), bool)
    p0, k = np.split(plans[found], [model.n_p], axis=1)
    paths = paths_of(model, p0, k)
    for i, row in enumerate(np.flatnonzero(found)):
        problem = problem_of(problems, row)
        scene = pruned_scene(NominalProblem(problem, model))
        part = sample_part(scene, model.tube, p0[i], k[i], paths[i])
        out[row] = prove(problem, model, [part])[0][0]
    return out
