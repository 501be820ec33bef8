"""The planner: one model, any number of queries."""

import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import jax

from parc_jax.answer.answer import Answer
from parc_jax.answer.looks import Looks
from parc_jax.common.errors import InputError, expected
from parc_jax.common.keys import Stage, as_key
from parc_jax.common.probes import require_sound_arithmetic
from parc_jax.learning.model import TrajectoryModel, check_model
from parc_jax.learning.system import System, check_system
from parc_jax.planner.batch import BatchAnswer, Problems, problem_of, solve_batch
from parc_jax.planner.prepared import Prepared
from parc_jax.problem.problem import ReachAvoid
from parc_jax.problem.robust.question import Question, plain_problems, question
from parc_jax.proof.regions import RegionTable, regions_of
from parc_jax.safe_set.batch.box_scenes import BoxScenes
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.near import near_scene
from parc_jax.safe_set.verdict.outline import require_same
from parc_jax.safe_set.verdict.scene import SceneArrays

if TYPE_CHECKING:
    from parc_jax.drive.local.localise import Local
    from parc_jax.drive.local.refine import Refined

COLD_WORK = 0.03  # two looks, with corridors between: `warm_up` wants the compiled programs alone


class Planner:
    """Answers reach-avoid queries about one model.

    model: network and claim. Raises InputError for anything else, and for a claim that was not made
    about this network, or has a part from elsewhere.
    """

    def __init__(self, model: TrajectoryModel):
        if not isinstance(model, TrajectoryModel):
            raise InputError(expected("Planner", "a TrajectoryModel", model, "pj.load(path)"))
        check_model(model)
        self.model = model
        self._under_doubt: dict[tuple, TrajectoryModel] = {}

    def __repr__(self) -> str:
        return f"Planner({self.model!r})"

    @property
    def regions(self) -> RegionTable:
        """All regions of the network over K, enumerated once."""
        return regions_of(self.model)

    def solve(
        self, problem: ReachAvoid, key: jax.Array, settings: Settings | None = None, *, at=None
    ) -> Answer:
        """The safe set of one problem: samples and corridors, with certificates.

        problem: from `reach_avoid` or `load_problem`; every plan of the answer withstands its
        doubt. key: from `jax.random`; its SEARCH stream is used. settings: sizes, work and
        method; by default `Settings.whole()`. at: where the robot is, x, y or x, y, heading: the
        answer is about plans from there, sets in k alone; with a heading told in the robot's frame,
        for a system that declares `rotation`.
        Raises InputError when the problem does not fit the model, SoundnessError when this
        installation computes wrong numbers.
        """
        settings = _checked("solve", problem, settings, Settings.whole())
        as_key(key)
        require_sound_arithmetic()
        begin = time.perf_counter()
        return self.prepare(problem, at=at)._solve(key, settings, begin)

    def prepare(self, problem: ReachAvoid, *, at=None) -> Prepared:
        """The problem laid out for this model, for many queries: safe plans from one compiled call
        each, or whole answers.

        problem, at: as of `solve`. Raises as `solve` does.
        """
        _checked("prepare", problem, None, Settings.whole())
        require_sound_arithmetic()
        return self._prepare(question(problem, self.model, at))

    def _prepare(self, asked: Question) -> Prepared:
        return Prepared(near_scene(asked.plain(self._under_doubt)))

    def warm_up(
        self,
        problem: ReachAvoid,
        settings: Settings | None = None,
        *,
        at=None,
        proof: bool = False,
    ) -> Answer:
        """Compile what a query of this size needs: a query with next to no work, from a stream of
        its own, so that the times of the next `solve` are those of a search. Its timings are those
        of a cold start; what it found is safe, and proved with `proof`, but covers little.
        """
        settings = _checked("warm_up", problem, settings, Settings.whole())
        cold = settings.replace(work=min(settings.work, COLD_WORK), proof=proof)
        apart = jax.random.fold_in(jax.random.PRNGKey(0), int(Stage.SEARCH))
        return self.solve(problem, apart, cold, at=at)

    def refine(
        self,
        problem: ReachAvoid,
        system: System,
        key: jax.Array,
        local: "Local | None" = None,
        *,
        shares: Sequence[float] = (2e-3, 2e-4, 2e-5, 2e-6),
        centres: int = 12,
        runs: int = 200,
        around: Sequence[Sequence[float]] = (),
        looks: int = 2,
        delta: float = 1e-3,
        settings: Settings | None = None,
        say: Callable[[str], None] | None = None,
    ) -> "Refined":
        """Search for a small box of K with new runs where plans of a problem are, or nearly are;
        then a plan, a claim about its box, and everything proved again under it. [T23, T24]

        For scenes too narrow for a model of the whole of K, and plans close to something.
        system: the black box of this model. key: only its DRIVEN stream is used, by no other call.
        local: sizes of the claims; its share and shape are not used, the shape of the tube is
        selected before the calibration runs. shares: of K that the boxes of each round take,
        falling. centres, runs: boxes a round, and runs of each. around: values of k (n_k,) that the
        first round samples too. looks: claims that may be made; delta: error probability of all of
        them together. settings: of the query under a claim. say: called with a line of progress.
        Raises InputError.
        """
        # imported late: queries alone need no trainer
        from parc_jax.drive.local.localise import Local
        from parc_jax.drive.local.refine import refine

        settings = _checked("refine", problem, settings, Settings.whole())
        if problem.doubt is not None:
            raise InputError("refine: expected a problem without doubt; set doubt=None.")
        check_system(system)
        require_same(system, self.model)
        local = Local() if local is None else local
        if not isinstance(local, Local):
            raise InputError(expected("refine", "a Local", local, "pj.Local(eps=1e-3)"))
        require_sound_arithmetic()
        return refine(
            question(problem, self.model),
            system,
            key,
            local,
            shares=tuple(shares),
            centres=centres,
            runs=runs,
            around=around,
            looks=Looks().declare(delta, looks),
            settings=settings,
            say=say,
        )

    def solve_batch(
        self,
        problems: Problems,
        key: jax.Array,
        settings: Settings | None = None,
        *,
        draws: int = 4096,
        pool: int = 1024,
        numbers=None,
        warm=None,
        whole: Sequence[int] = (),
        mesh=None,
    ) -> BatchAnswer:
        """Safe plans for many problems in a few compiled calls. Uses the SEARCH stream of `key`.

        problems: a list, `box_scenes` (no cost per scene in Python), or stacked scene arrays. Those
        of a list may be under doubt, all under the same one but for goal and obstacles.
        settings: by default `Settings.fast()`; of its fields samples (safe plans per problem) and
        proof (exact check of every best plan, some ten milliseconds each) count here.
        draws: most plans to propose per problem; solved ones stop early. pool: values of k shared
        by all. numbers: (s,) the problems' own numbers, by default 0, 1, ...: with the key they
        decide an answer, so it does not depend on what else is in the batch. warm: an earlier
        BatchAnswer of the same problems, or plans. whole: rows that `solve` answers as well, with
        these settings, or with `Settings.whole()` where these are for samples only. mesh: devices
        to spread over (`distributed.mesh`).
        Raises as `solve` does.
        """
        settings = Settings.fast() if settings is None else settings
        if not isinstance(settings, Settings):
            raise InputError(expected("solve_batch", "Settings", settings, "pj.Settings.fast()"))
        if isinstance(problems, ReachAvoid):
            raise InputError("solve_batch: expected several problems; got one. Use `solve`.")
        require_sound_arithmetic()
        chosen = {int(i): problem_of(problems, i) for i in whole}
        model = self.model
        if not isinstance(problems, BoxScenes | SceneArrays):
            problems, model = plain_problems(problems, model, self._under_doubt)
        answer = solve_batch(
            model,
            problems,
            key,
            samples=settings.samples,
            draws=draws,
            pool=pool,
            numbers=numbers,
            warm=warm,
            proof=settings.proof,
            mesh=mesh,
        )
        each = Settings.whole() if settings.samples_only else settings
        return answer._replace(answers={i: self.solve(p, key, each) for i, p in chosen.items()})


def answer_to(
    asked: Question, key: jax.Array, settings: Settings | None = None, looks: Looks | None = None
) -> Answer:
    """The answer to a question, all of it. settings: as of `Planner.solve`. looks: the account of
    an answer that it comes of; None for one of its own. Raises as `Planner.solve` does.
    """
    settings = _checked("solve", asked.problem, settings, Settings.whole())
    require_sound_arithmetic()
    begin = time.perf_counter()
    return Planner(asked.model)._prepare(asked)._solve(key, settings, begin, looks)


def _checked(call: str, problem, settings, default: Settings) -> Settings:
    """The settings, after a look at the types that users mix up."""
    if not isinstance(problem, ReachAvoid):
        hint = "pj.exchange.load_problem(path) reads a scene file, pj.reach_avoid(...) makes one"
        raise InputError(expected(call, "a problem", problem, hint))
    if settings is None:
        return default
    if not isinstance(settings, Settings):
        hint = "pj.Settings(samples=10) or pj.Settings.fast()"
        raise InputError(expected(call, "Settings", settings, hint))
    return settings
