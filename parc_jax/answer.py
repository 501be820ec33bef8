"""The answer to a query: samples, safe polytopes, coverage, and the two sentences that say what
they are worth.
"""

import copy
import html
import json
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import jax
import numpy as np

from parc_jax.certificate.prove import prove
from parc_jax.certificate.write import answer_part
from parc_jax.claim.counts import clopper_pearson, least_probability
from parc_jax.claim.risk import Density, NoStatement, Risk
from parc_jax.cover.best import best_plan
from parc_jax.cover.corridor import Corridor
from parc_jax.cover.corridors import Corridors
from parc_jax.cover.kept import KeptPlans
from parc_jax.cover.later import cut_later
from parc_jax.cover.place import Place
from parc_jax.cover.plan_set import PlanSet
from parc_jax.cover.polytope import SafePolytope
from parc_jax.cover.sampling import generator
from parc_jax.cover.search import Cover, Progress
from parc_jax.cover.solid import Solid
from parc_jax.cover.stopping import Coverage
from parc_jax.cover.union import SafeUnion
from parc_jax.driven.looks import Looks
from parc_jax.errors import InputError
from parc_jax.lp.status import LPStatus
from parc_jax.model import TrajectoryModel
from parc_jax.problem import ReachAvoid
from parc_jax.robust.pose import Pose
from parc_jax.robust.withstood import Withstood
from parc_jax.rollout.files import write_atomic
from parc_jax.sentences import (
    NONE_OF_COPIES,
    NOTHING_FOUND,
    about_doubt,
    about_place,
    about_plans,
    about_pose,
    about_risk,
    about_sensing,
)
from parc_jax.sets.chebyshev import chebyshev_center
from parc_jax.sets.hpolytope import HPolytope
from parc_jax.spelling import hex_text
from parc_jax.status import Status
from parc_jax.verdict.scene import Scene
from parc_jax.volume_bounds.no_plan import PROVED, NoPlan

if TYPE_CHECKING:
    from parc_jax.driven.choice import Choice, Solve

CUT_AROUND = 20_000  # safe plans around which `with_polytopes` cuts
SPREAD_OUT = 6  # dimensions of (p0, k) up to which polytopes that nobody asked for are cut


class Answer:
    """What `Planner.solve` returns. All methods take and return float64 NumPy arrays.

    samples (n, n_p + n_k): safe starts and parameters, uniform over the safe set.
    proved: the independent checker accepted all that is returned. refused: samples, corridors and
    polytopes that it did not accept and that are therefore not in the answer. no_plan: when no draw
    was safe, what branch and bound says: proved that none is, or how much is undecided.
    doubt: what all plans withstand; `problem` and `model` are then the plain ones that allow for
    it. pose: where the robot is, where that was asked: all plans start there, and with a heading
    the scene is told in the robot's frame.
    """

    def __init__(
        self,
        model: TrajectoryModel,
        scene: Scene,
        cover: Cover,
        samples: np.ndarray,
        sample_parts: list[dict] | Callable[[], list[dict]],
        proved: bool,
        refused: int,
        timings: dict[str, float],
        no_plan: NoPlan | None,
        doubt: Withstood | None = None,
        pose: Pose | None = None,
    ):
        self.model = model
        self.scene = scene
        self.samples = samples
        self._sample_parts = sample_parts
        self.proved = proved
        self.refused = refused
        self.timings = timings
        self.no_plan = no_plan
        self.doubt = doubt
        self.pose = pose
        self.solve: Solve | None = None  # the same question with another model, of `Planner`
        self._looks: Looks | None = None
        self._cover = cover
        self._corridors = Corridors(model.tube, cover.corridors)
        self._plans: PlanSet = (
            SafeUnion(model, scene, list(cover.polytopes))
            if len(cover.polytopes)
            else KeptPlans(model, scene, self._corridors, cover.within)
        )

    @cached_property
    def sample_parts(self) -> list[dict]:
        """The certificates of the samples, written when they are first asked for."""
        return self._sample_parts() if callable(self._sample_parts) else self._sample_parts

    @property
    def problem(self) -> ReachAvoid:
        """The question, as it was asked."""
        return self.scene.problem

    @property
    def found(self) -> bool:
        """A safe plan exists and is in hand."""
        return len(self.samples) + len(self.corridors) + len(self.polytopes) > 0

    @property
    def status(self) -> Status:
        """What is known: safe plans proved or bounded, none exists (proved), or none found."""
        if self.found:
            return Status.PROVED if self.proved else Status.BOUNDED
        absent = self.no_plan is not None and self.no_plan.kind == PROVED
        return Status.NO_PLAN if absent else Status.NOT_FOUND

    def __repr__(self) -> str:
        name = self.model.system or "unnamed system"
        if not self.found:
            return f"<Answer for {name}: {self.status}>"
        share = f"at least {100 * self._held.at_least:.1f} % of the model's safe set"
        if self._cover.within is not None:
            share += " around what a search found"
        return (
            f"<Answer for {name}: {self.status}, {len(self.samples)} plans, "
            f"{len(self.corridors)} corridors, {len(self.polytopes)} polytopes, {share}>"
        )

    def _repr_html_(self) -> str:
        lines = "".join(f"<li>{html.escape(line)}</li>" for line in self.statement().split("\n"))
        return f"<b>{html.escape(repr(self)[1:-1])}</b><ul>{lines}</ul>"

    @property
    def corridors(self) -> Sequence[Corridor]:
        """One separating direction per obstacle and interval each: every plan that keeps to one and
        ends in the shrunken goal is safe, whatever its region. The safe polytopes are their
        intersections with the cells."""
        return self._corridors.all

    @property
    def polytopes(self) -> list[SafePolytope]:
        """The safe polytopes: pattern, bin, corridor and inner point each. None unless the query
        cut them (`Settings.polytopes`); `with_polytopes` cuts them later."""
        return list(self._cover.polytopes)

    def with_polytopes(self, key: jax.Array, n: int = CUT_AROUND) -> "Answer":
        """This answer with its corridors cut into polytopes around n fresh safe plans, proved where
        this answer is. Its `coverage` is that of one look at 6,000 further plans.

        Corridors know no regions, polytopes do: they are many where parameters are.
        """
        confidence = self.corridor_coverage.confidence
        asked = self.model, self.scene, key, self._corridors, self._cover.within
        polytopes, coverage = cut_later(*asked, n, confidence)
        refused = self.refused
        if self.proved:
            accepted = prove(self.scene.problem, self.model, [], (), polytopes)[2]
            refused += int((~accepted).sum())
            if not accepted.all():
                polytopes = [p for p, kept in zip(polytopes, accepted, strict=True) if kept]
                coverage = coverage._replace(at_least=0.0)
        cut = copy.copy(self)
        for name in _CACHED:
            cut.__dict__.pop(name, None)
        cut.refused = refused
        cut._cover = self._cover._replace(polytopes=polytopes, coverage=coverage)
        if polytopes:
            cut._plans = SafeUnion(self.model, self.scene, polytopes)
        return cut

    @cached_property
    def in_polytopes(self) -> "Answer":
        """This answer with safe polytopes: itself where the query cut some, else with those cut
        now. Raises InputError beyond SPREAD_OUT dimensions of (p0, k), where `with_polytopes`
        must be asked.
        """
        if len(self.polytopes) or not len(self.corridors):
            return self
        n = self.model.n_k + (self.model.n_p if self.scene.at is None else 0)
        if n > SPREAD_OUT:
            raise InputError(
                f"expected at most {SPREAD_OUT} dimensions of (p0, k) for polytopes that were not "
                f"asked for; this answer has {n}. Use `sample`, `keeps` and `best`, which need "
                "none, or cut them with `with_polytopes`."
            )
        return self.with_polytopes(jax.random.PRNGKey(0))

    @cached_property
    def _solids(self) -> list[Solid]:
        """The polytopes in the round; of an answer without any, those cut now."""
        plans = self.in_polytopes._plans
        if not isinstance(plans, SafeUnion):
            return []
        return [solid for solid in plans.solids if solid is not None]

    @cached_property
    def safe_sets(self) -> list[HPolytope]:
        """Safe convex polytopes in (p0, k), each inside one region and one bin, redundant rows
        removed; in k alone where all plans have one start, `scene.at`. Cut on first use where the
        query cut none.
        """
        return [solid.polytope for solid in self._solids]

    @cached_property
    def volumes(self) -> np.ndarray:
        """Volume of every polytope of `safe_sets` [units of p0 and k multiplied]; they may overlap
        inside a region.
        """
        return np.array([solid.volume for solid in self._solids])

    @property
    def history(self) -> Sequence[Progress]:
        """Progress of the search at every fresh draw: seconds from its start, corridors and
        polytopes so far, shares that they cover.
        """
        return self._cover.history

    @property
    def coverage(self) -> Coverage:
        """Share of the model's safe set inside `polytopes`: estimate, lower confidence bound,
        counts behind them.
        """
        return self._cover.coverage

    @property
    def corridor_coverage(self) -> Coverage:
        """Share of the model's safe set that keeps to some of `corridors`, as in `coverage`."""
        return self._cover.kept

    @property
    def _held(self) -> Coverage:
        """Coverage of what `sample` draws from."""
        return self.coverage if len(self.polytopes) else self.corridor_coverage

    @property
    def counts(self) -> dict[str, int]:
        """Points drawn uniformly over all that could reach the goal, how many of them do, how many
        are safe.
        """
        return {
            "drawn": self._cover.drawn,
            "reaching": self._cover.reaching,
            "safe": self._cover.safe,
        }

    @property
    def around(self) -> Place | None:
        """Where safe plans are too rare for draws from everywhere, the place around what a search
        found that was drawn from instead; counts, coverage and volume are of it then.
        """
        return self._cover.within

    @property
    def safe_share(self) -> float:
        """Share of the goal-reaching set (of the model) that is safe; of `around`, where that is a
        place.
        """
        return self._cover.safe / max(self._cover.reaching, 1)

    def volume(self, confidence: float = 0.99) -> tuple[float, float, float] | None:
        """Volume of the model's safe set: estimate and Clopper-Pearson interval, in units of p0 and
        k multiplied. Where safe plans are so rare that draws came from a place, of the part in it.

        None when nothing was drawn uniformly (the published search). The interval takes the number
        of draws as fixed.
        """
        whole = self._cover.volume
        if not self._cover.drawn or not np.isfinite(whole):
            return None
        n, x, tail = self._cover.drawn, self._cover.safe, (1 - confidence) / 2
        low, high = least_probability(x, n, tail), float(clopper_pearson(x, n, tail))
        return whole * x / n, whole * low, whole * high

    def contains(self, p0, k) -> np.ndarray:
        """p0 (b, n_p), k (b, n_k) -> bool (b,): inside a returned safe polytope; without any, safe
        by one of `corridors`.
        """
        return self._plans.contains(*self._given("contains", p0, k))

    def keeps(self, p0, k) -> np.ndarray:
        """p0 (b, n_p), k (b, n_k) -> bool (b,): safe, as it keeps to one of `corridors`."""
        kept = KeptPlans(self.model, self.scene, self._corridors, self._cover.within)
        return kept.contains(*self._given("keeps", p0, k))

    def _given(self, name: str, p0, k) -> tuple[np.ndarray, np.ndarray]:
        try:
            p0, k = np.atleast_2d(np.asarray(p0, float)), np.atleast_2d(np.asarray(k, float))
        except (TypeError, ValueError) as error:
            raise InputError(f"{name}: expected numbers; {error}.") from None
        if p0.shape[1:] != (self.model.n_p,) or k.shape != (len(p0), self.model.n_k):
            raise InputError(
                f"{name}: expected p0 (b, {self.model.n_p}) and k (b, {self.model.n_k}); got "
                f"{p0.shape}, {k.shape}."
            )
        return p0, k

    def sample(self, key: jax.Array, n: int) -> np.ndarray:
        """n plans (n, n_p + n_k) drawn uniformly from the union of `polytopes`; without any, from
        all plans that are safe by one of `corridors`. Consumes `key`.
        """
        if n < 0:
            raise InputError(f"sample: expected a number of plans >= 0; got {n}.")
        return self._plans.sample(generator(key), n)

    def project(self, dims) -> list[np.ndarray]:
        """Vertices (v, len(dims)) of every safe polytope projected onto coordinates of (p0, k), for
        plots. Polytopes are cut on first use where the query cut none.
        """
        n = self.model.n_p + self.model.n_k
        if not all(0 <= d < n for d in dims):
            raise InputError(
                f"project: expected coordinates of (p0, k), 0 to {n - 1}; got {list(dims)}."
            )
        return [solid.vertices[:, list(dims)] for solid in self._solids]

    def best(self, objective="clearance", key: jax.Array | None = None) -> tuple[np.ndarray, float]:
        """The plan (n_p + n_k,) of the safe set with the largest objective found, and its value.

        objective: "clearance" [m]; "room", the least of clearance and of the margins of goal and
        start; a vector c for the linear c . (p0, k), exact at a vertex of `polytopes`; or a JAX
        function of p0 (n_p,), k (n_k,). A hand-picked k has no probabilistic statement: see
        `risk`.
        """
        return best_plan(
            self._plans, objective, generator(jax.random.PRNGKey(0) if key is None else key)
        )

    def choose(
        self, objective="room", key: jax.Array | None = None, *, delta=1e-3, looks: int = 1
    ) -> "Choice":
        """The one plan that is driven: the best for an objective, as in `best`. [T23]

        Its `statement()` says what is known of this plan without new runs; `Choice.run` and
        `Choice.claim_near` make runs, and each is a look. delta, looks: error probability of all
        looks at plans of this answer together, and how many there may be; declared by the first
        choice, kept by later ones. Raises InputError.
        """
        if self.doubt is not None:
            raise InputError(
                "choose: expected an answer without doubt, for its sentences are about one plan "
                "driven exactly; solve the same problem with doubt=None and choose from that."
            )
        if self._looks is None:
            self._looks = Looks(delta, looks)
        declared = Looks(delta, looks)
        same = (declared.delta, declared.planned) == (self._looks.delta, self._looks.planned)
        if not same:
            raise InputError(
                f"choose: expected the looks declared by the first choice, {self._looks!r}; got "
                f"{looks} looks and delta = {delta}."
            )
        plan, value = self.best(objective, key)
        from parc_jax.driven.choice import Choice  # it trains: whoever only asks needs no trainer

        return Choice(plan, value, self.model, self.scene, self._looks, self.solve)

    def safest(self) -> tuple[np.ndarray, float]:
        """Centre (n_p + n_k,) and radius of the largest ball, in (p0, k) units, inside one safe
        polytope.

        Its radius is room for state-estimation and command error: every plan in the ball is safe.
        """
        balls = [chebyshev_center(s) for s in self.safe_sets]
        known = [(b.center, float(b.radius)) for b in balls if b.status == LPStatus.FEASIBLE]
        if not known:
            raise InputError("safest: expected an answer with safe polytopes; this one has none.")
        return max(known, key=lambda ball: ball[1])

    @cached_property
    def share_of_k(self) -> float:
        """Lower estimate of Pi(T): share of K with a start in what `sample` draws from."""
        share = self._plans.share_of_k()
        return share if self.doubt is None else share * self.doubt.share_of_k(self.model.domain)

    @property
    def density(self) -> float:
        """Upper bound W of the density of k, relative to uniform on K, when plans are drawn by
        `sample`. Else infinite. [T34]

        Per unit of k a bin offers at most the box of end points in the goal less its error;
        `sample` spreads over the whole union, whose volume is at least the lower bound of the safe
        set's times the covered share.
        """
        least, most = self.model.tube.end_extent
        with np.errstate(invalid="ignore"):
            room = (self.scene.z_hi - most) - (self.scene.z_lo - least)
            ends = np.prod(np.maximum(room, 0), axis=1)
        if self.scene.at is not None:  # k alone is drawn
            ends = np.ones(1)
        known = self.volume(0.999)
        union = 0.0 if known is None else known[1] * self._held.at_least
        whole = self.model.domain.volume if self.doubt is None else self.doubt.k_volume
        return float(whole * np.nanmax(ends) / union) if union > 0 else np.inf

    def risk(self) -> Risk | NoStatement:
        """What the claim promises for a plan drawn by `sample`: uniformly from the safe polytopes,
        or without any from all that the corridors hold. [T5, T18, T34]

        The density of such k relative to the claim's uniform law is at most `density`. For another
        law over k use `model.claim.risk`: with k itself uniform on the certified k-set,
        Uniform(answer.share_of_k).
        """
        if not len(self.polytopes) and not len(self.corridors):
            return NoStatement("there is no safe set to draw k from")
        promised = self.model.claim.risk(Density(1.0))
        if isinstance(promised, NoStatement) or self.model.claim.kind == "cover":
            return promised
        law = self.model.claim.law.k_law
        if law != "uniform":
            return NoStatement(f"the claim is about k drawn by {law!r}, not uniformly over K")
        if not np.isfinite(self.density):
            return NoStatement(
                "how much of the safe set they cover was not measured within the budget"
            )
        return self.model.claim.risk(Density(self.density))

    def statement(self) -> str:
        """The two sentences: (C) what is proved of the model and its tube, (E) what is known of the
        tube.
        """
        claim = self.model.claim
        about_tube = f"(E) {claim.statement()}"
        if self.doubt is not None:
            about_tube = f"{about_doubt(self.doubt.words)}\n{about_tube}"
        if self.pose is not None:
            about_tube = f"{about_pose(self.pose.place, self.pose.heading)}\n{about_tube}"
        if not self.found:
            if self.no_plan is None:
                return NOTHING_FOUND
            none = self.no_plan.statement()
            if self.no_plan.kind == PROVED and self.doubt is not None and self.doubt.copies:
                none = f"{none} {NONE_OF_COPIES}"
            return f"{none}\n{about_tube}"
        counts = len(self.samples), len(self.polytopes), len(self.corridors)
        plans = about_plans(*counts, self.proved)
        within = self._cover.within
        if within is not None:
            k_lo, k_hi = (side[-self.model.n_k :] for side in within.box)
            plans = f"{plans}\n{about_place(k_lo, k_hi)}"
        drawn = "the safe polytopes" if len(self.polytopes) else "all that the corridors hold"
        risk = about_risk(self.risk(), drawn, self.density, self._held.confidence, claim.delta)
        if self.doubt is not None and self.doubt.sensing_eps:
            risk = f"{risk} {about_sensing(self.risk(), self.doubt.sensing_eps)}"
        return f"(C) {plans}\n{about_tube}\n{risk}"

    def to_json(self) -> dict:
        """The answer as certificates; numbers are strings, nothing in it has to be trusted but the
        tube.
        """
        meta = {
            "system": self.model.system,
            "labels": self.model.labels._asdict(),
            "points": list(self.model.points),
            "time": [self.model.time.dt, self.model.time.t_f, self.model.time.dt_record],
            "status": self.status.label,
            "statement": self.statement(),
            "counts": self.counts,
            "volume_drawn": self._cover.volume,
            "coverage": self.coverage._asdict(),
            "corridor_coverage": self.corridor_coverage._asdict(),
        }
        if self._cover.within is not None:
            meta["within"] = [hex_text(side) for side in self._cover.within]
        if self.doubt is not None:
            meta["doubt"] = self.doubt.to_json()
        if self.scene.at is not None:
            meta["at"] = hex_text(self.scene.at)
        if self.pose is not None:
            meta["pose"] = [*self.pose.place.tolist(), self.pose.heading]
        no_plan = None if self.no_plan is None else self.no_plan.certificate
        return answer_part(
            self.problem,
            self.model,
            self.sample_parts,
            self.corridors,
            self.polytopes,
            no_plan=no_plan,
            meta=meta,
        )

    def save(self, path) -> Path:
        """Write answer.json; it appears complete or not at all. `parc-jax check` verifies it."""
        return write_atomic(path, json.dumps(self.to_json(), separators=(",", ":")).encode())


_CACHED = (
    "in_polytopes",
    "_solids",
    "safe_sets",
    "volumes",
    "share_of_k",
)  # that depend on the polytopes
