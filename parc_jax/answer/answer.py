"""The answer to a query: plans, the corridors that hold them, and the worth of both."""

import html
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import jax
import numpy as np

from parc_jax.answer.looks import Looks
from parc_jax.answer.path import NominalPath, nominal_path
from parc_jax.answer.risk import about_draw, risk_of_draw
from parc_jax.answer.why import Why, why_of
from parc_jax.common.arrays import Sealed, once, read_only
from parc_jax.common.errors import InputError, check_count, reading
from parc_jax.common.keys import as_key, generator
from parc_jax.common.spelling import hex_text
from parc_jax.common.status import Status
from parc_jax.learning.bound.claim import recorded
from parc_jax.learning.bound.counts import NoStatement, Risk
from parc_jax.learning.bound.statement import VALIDATED
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.runs.files import write_atomic
from parc_jax.problem.problem import Problem
from parc_jax.problem.world.outlines import Edge
from parc_jax.proof.absence.prove_no_plan import PROVED, NoPlan
from parc_jax.proof.certificate.prove import prove
from parc_jax.proof.certificate.write import answer_part
from parc_jax.safe_set.corridors.corridor import Corridor
from parc_jax.safe_set.corridors.corridors import Corridors
from parc_jax.safe_set.corridors.polytopes import Polytopes, cut_polytopes
from parc_jax.safe_set.corridors.safe_plans import SafePlans, as_plans, best_plan
from parc_jax.safe_set.corridors.search import Cover, Share
from parc_jax.safe_set.corridors.stopping import Coverage
from parc_jax.safe_set.verdict.scene import Scene
from parc_jax.statement import details, headline, resting_on, summary

if TYPE_CHECKING:
    from parc_jax.drive.local.choice import Choice
    from parc_jax.drive.local.validation import Validation

CUT_AROUND = 20_000  # safe plans around which `polytopes` cuts


@dataclass(frozen=True, eq=False, repr=False)
class Answer(Sealed):
    """The result of `Planner.solve`. All methods take and return float64 NumPy arrays.

    samples (n, n_p + n_k): safe starts and parameters, uniform over the safe set.
    absence: where hardly a draw was safe, the result of branch and bound: proved that no plan is
    safe, or how much is undecided; else None.
    scene: the nominal problem as arrays. With uncertainty, all plans are robust to it; with a pose,
    all start there, and with a heading the scene is in the robot's frame.
    cover: counts, times and end of the search. looks: the one account of tests of plans of this
    answer and of all that is derived from it. written: certificates of the samples, or a function
    that writes them. validation: of nested sets in this scene, if any. unchecked: a
    sentence about what is the word of the file that it was read from, empty for an answer that was
    found here. Raises InputError for a validation of another query.
    """

    scene: Scene
    cover: Cover
    samples: np.ndarray
    written: list[dict] | Callable[[], list[dict]]
    absence: NoPlan | None = None
    looks: Looks = field(default_factory=Looks)
    validation: "Validation | None" = None
    unchecked: str = ""

    def __post_init__(self) -> None:
        # written over, they would be called proved by the certificates of others
        object.__setattr__(self, "samples", read_only(np.array(self.samples)))
        if self.validation is None or self.validation.answer is None:
            return
        own, tested = self.scene.nominal.query, self.validation.answer
        its, of = tested.scene.nominal.query, tested.model.claim.evidence or {}
        same = own and its and its.problem is own.problem and its.pose is own.pose
        if not same or of.get("of") != self.model.claim.hash:
            raise InputError(
                "answer: expected a validation of this very query; got another's. Solve it anew."
            )

    def __repr__(self) -> str:
        return f"<{headline(self)}>"

    def _repr_html_(self) -> str:
        lines = "".join(f"<li>{html.escape(line)}</li>" for line in self.details().split("\n"))
        return f"<b>{html.escape(headline(self))}</b><ul>{lines}</ul>"

    @property
    def problem(self) -> Problem:
        """The nominal problem, which allows for all uncertainty; `scene.nominal.query` has the
        problem as it was posed.
        """
        nominal = self.scene.nominal
        labels = nominal.query.problem.labels if nominal.query else ()  # they are in no program
        return replace(nominal.problem, labels=labels) if labels else nominal.problem

    @property
    def model(self) -> TrajectoryModel:
        """The model of the nominal problem."""
        return self.scene.nominal.model

    @property
    def corridors(self) -> Sequence[Corridor]:
        """One separating direction per obstacle and interval each: every plan that satisfies one
        and ends in the shrunken goal is safe, in every region of the network. [T27]
        """
        return self.cover.corridors

    @cached_property
    def certificates(self) -> list[dict]:
        """Of the samples, written on first use."""
        return self.written() if callable(self.written) else self.written

    @property
    def status(self) -> Status:
        """Safe plans proved or bounded, none exists (proved), or none found."""
        if len(self.samples) + len(self.corridors):
            return Status.PROVED if self.cover.proved else Status.BOUNDED
        absent = self.absence is not None and self.absence.kind == PROVED
        return Status.NO_PLAN if absent else Status.NOT_FOUND

    @property
    def coverage(self) -> Coverage:
        """Share of the model's safe set that the corridors hold: estimate, lower bound, counts."""
        return self.cover.coverage

    @property
    def share(self) -> Share | None:
        """Share of all (p0, k) whose first point ends in the goal's box, or of all k from the one
        start, that is safe: the number to tune by; with the volume of the safe set. Where draws
        were made in a place, only plans in it count. None when nothing was drawn uniformly.
        """
        return self.cover.share

    @cached_property
    def _corridors(self) -> Corridors:
        return Corridors(self.model.tube, self.cover.corridors)

    @cached_property
    def _plans(self) -> SafePlans:
        return SafePlans(self.scene, self._corridors, self.cover.within)

    def contains(self, p0, k) -> np.ndarray:
        """Which plans are shown safe by a corridor; of an answer from one start those from there.

        p0: (b, n_p) [m] starts. k: (b, n_k) parameters.
        Returns bool (b,). Raises InputError.
        """
        return self._plans.contains(*as_plans("contains", self.model, p0, k))

    def sample(self, key: jax.Array, n: int) -> np.ndarray:
        """n plans (n, n_p + n_k) drawn uniformly from all that the corridors hold. Consumes `key`.
        Raises InputError, also for a set that recordings tested, whose law is that of `starts`.
        """
        check_count("sample", n, 0, "100 plans")
        if recorded(self.model.claim):
            raise InputError(
                "sample: expected a set that was tested by uniform draws; this one was tested by "
                "recordings: draw one run of each new one, with k in K, then starts(key, k) of it."
            )
        return self._plans.sample(generator(key), n)

    def starts(self, key: jax.Array, k, most: int = 1) -> list[np.ndarray]:
        """For each k (b, n_k) starts (m, n_p), at most so many, drawn uniformly from all that the
        corridors hold for it; none where no plan of 400, whose ends are drawn in the goal, is held.
        Consumes `key`. Raises InputError.
        """
        check_count("starts: most", most, 0, "1, for each k")
        with reading("starts: k", "numbers"):
            k = np.atleast_2d(np.asarray(k, float))
        k = as_plans("starts", self.model, np.zeros((len(k), self.model.n_p)), k)[1]
        return self._plans.starts(generator(key), k, most)

    def path(self, p0, k) -> NominalPath:
        """The predicted path of the plan p0 (n_p,), k (n_k,), with times and tube; in the frame of
        `model`, whose points, under uncertainty of execution or heading, are copies of the robot's.
        What else is uncertain comes on top.

        Raises InputError for a plan outside of K. `save` writes it as .csv.
        """
        starts, values = as_plans("path", self.model, p0, k)
        if len(starts) != 1:
            raise InputError(f"path: expected one plan; got {len(starts)}. Ask one at a time.")
        nominal = self.scene.nominal
        path = nominal_path(self.model, starts[0], values[0])
        return replace(path, alone=nominal.uncertainty is not None, turned=nominal.turned)

    def best(self, objective="clearance", key: jax.Array | None = None) -> tuple[np.ndarray, float]:
        """The plan (n_p + n_k,) that the corridors hold with the largest objective found, and its
        value.

        objective: "clearance" [m]; "room", the least of clearance and of the margins of goal and
        start; a vector c for the linear c . (p0, k); or a JAX function of p0 (n_p,), k (n_k,). A
        hand-picked k has no probabilistic statement: see `risk`. Raises InputError.
        """
        if self.model.claim.kind == VALIDATED:
            raise InputError(
                "best, choose: expected the answer under the claim's own tube, for a plan that is "
                "chosen is not drawn; this is a validated set. Choose from the answer that has it."
            )
        rng = generator(jax.random.PRNGKey(0) if key is None else as_key(key))
        return best_plan(self._plans, objective, rng)

    def choose(
        self,
        objective="room",
        key: jax.Array | None = None,
        *,
        delta=None,
        looks: int | None = None,
    ) -> "Choice":
        """The one plan that is driven: the best for an objective, as in `best`. [T23]

        Its `details()` has the sentences about this plan without new runs; `Choice.test` and
        `Choice.localise` make runs, and each is a look.

        delta, looks: error probability of all looks at plans of this answer together, and how many
        there may be; 1e-3 and one unless the first choice declares others. Later choices and the
        answer's file keep them. Raises InputError.
        """
        if self.scene.nominal.uncertainty is not None:
            raise InputError(
                "choose: expected an answer without uncertainty, for its sentences are about one "
                "plan driven exactly; solve the same problem with uncertainty=None, or with "
                'what is measured given as "free", and choose from that.'
            )
        plan, value = self.best(objective, key)
        account = self.looks.declare(delta, looks)
        # a late import, since a choice can train: a query alone loads no trainer
        from parc_jax.drive.local.choice import Choice

        return Choice(plan, value, self.scene, account, unchecked=self.unchecked)

    def polytopes(self, key: jax.Array, n: int = CUT_AROUND) -> Polytopes:
        """The corridors cut into safe convex polytopes of (p0, k) around n fresh safe plans, proved
        where this answer is; for pictures, and for other optimisers. [T29, T31]

        Their number, and the work, grow fast with the parameters: corridors cross regions of the
        network, polytopes do not. n: plans drawn. Consumes `key`.
        """
        check_count("polytopes", n, 0, f"{CUT_AROUND} plans")
        cover = self.cover

        def accepts(polytopes: list) -> np.ndarray:
            return prove(self.problem, self.model, [], (), polytopes)[2]

        sure, proof = cover.coverage.confidence, accepts if cover.proved else None
        return cut_polytopes(
            self.scene, self._corridors, key, n, within=cover.within, confidence=sure, accepts=proof
        )

    def share_of_k(self) -> float:
        """Lower bound of the share of K that has a start in the corridors, Pi(T), with 99.9 %
        confidence. Only a few ends in the goal are tried for each k, so the share may be larger;
        where parameters are given or unknown it is 0. The first call tries thousands of k.
        """
        uncertainty, part = self.scene.nominal.uncertainty, 1.0
        if uncertainty is not None:
            of_k, chosen = uncertainty.parameters
            part = self.model.domain.volume / uncertainty.k_volume if chosen == of_k else 0.0
        if not part or self.model.given:
            return 0.0
        return part * once(self._plans, SafePlans.share_of_k)

    def risk(self) -> Risk | NoStatement:
        """The claim's bound for a plan drawn by `sample`. [T5, T18, T34]

        Rests on `density_of_k`. For another law over k use `model.claim.risk`: with k uniform on
        the certified k-set, `share=answer.share_of_k()`, where the claim's runs had k uniform on K;
        add 0.001 to its `unconditional`, for the share was measured, too.
        """
        return risk_of_draw(self)

    def summary(self) -> str:
        """The answer in a few lines: status, share of plans that are safe, coverage, risk, and the
        assumptions that it rests on. `details` has all sentences.
        """
        return summary(self, about_draw(self))

    def details(self, polytopes: Polytopes | None = None) -> str:
        """All sentences: (C) the proof about the model and its tube, (E) the bound of the tube's
        error, the risk of a drawn plan.

        polytopes: of this answer, to be included in (C).
        """
        if polytopes is not None and polytopes.scene is not self.scene:
            raise InputError(
                "polytopes: expected polytopes of this answer; got those of another. Cut them with "
                "`answer.polytopes(key)`."
            )
        return details(self, about_draw(self), 0 if polytopes is None else len(polytopes))

    def why(self) -> Why:
        """What is in the way where no plan is safe, or few are: which obstacle, side of the goal or
        start, by how much and when, the tube's part of it, and what would help. A search of its
        own; its numbers are of plans that were tried, and no proof.
        """
        return once(self.scene, why_of)

    def save(self, path, polytopes: Polytopes | None = None) -> Path:
        """Write answer.json; it appears complete or not at all. `parc-jax check` verifies it.

        polytopes: of this answer, whose certificates go into the file; the checker verifies them,
        and `load_answer` returns the answer without them. Raises InputError for another answer's.
        """
        data = answer_data(self, polytopes)
        return write_atomic(path, json.dumps(data, separators=(",", ":")).encode())


def answer_data(answer: Answer, polytopes: Polytopes | None = None) -> dict:
    """The content of answer.json: certificates with numbers as strings, of which only the tube has
    to be trusted. polytopes: as of `Answer.save`.
    """
    cover, asked = answer.cover, answer.scene.nominal
    uncertainty, pose, scene = asked.uncertainty, asked.pose, answer.scene
    part = scene.box_of_k != answer.model.claim.law.box  # of K alone was asked for
    meta: dict = {
        "status": answer.status.label,
        "ended": None if cover.ended is None else cover.ended.label,
        "statement": answer.details(polytopes),
        "counts": {"drawn": cover.drawn, "reaching": cover.reaching, "safe": cover.safe},
        "volume_drawn": cover.volume,
        "volume_of_all": cover.total_volume,
        "coverage": cover.coverage._asdict(),
    }
    spans = [s and (s.dt, s.at, s.said, s.mover, s.told_loop) for s in answer.problem.all_spans]
    edges = [o.written if isinstance(o, Edge) else None for o in answer.problem.obstacles]
    optional = {
        "rests_on": resting_on(asked) or None,
        "spans": spans if any(answer.problem.spans) else None,
        "places": getattr(answer.problem.body, "places", None) or None,
        "edges": edges if any(e is not None for e in edges) else None,
        "polytope_coverage": None if polytopes is None else polytopes.coverage._asdict(),
        "within": None if cover.within is None else [hex_text(side) for side in cover.within],
        "doubt": None if uncertainty is None else uncertainty.to_json(),
        "k": hex_text([scene.k_lo, scene.k_hi]) if part else None,
        "at": None if scene.at is None else hex_text(scene.at),
        "looks": answer.looks.to_json(),
        "pose": None if pose is None else [*pose.place.tolist(), pose.heading],
    }
    meta |= {name: value for name, value in optional.items() if value is not None}
    of = answer.problem, answer.model, answer.certificates, answer.corridors
    cut = () if polytopes is None else polytopes.all
    no_plan = None if answer.absence is None else answer.absence.certificate
    return answer_part(*of, cut, no_plan=no_plan, meta=meta)
