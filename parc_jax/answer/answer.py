"""The answer to a query: ask it for plans, for the sets they come from, and for what they are
worth.
"""

import json
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import jax
import numpy as np

from parc_jax.answer import cut
from parc_jax.answer.findings import Findings
from parc_jax.answer.numbers import SafeShare, density_of_k, risk_of_draw, safe_share, safe_volume
from parc_jax.answer.path import NominalPath, nominal_path
from parc_jax.answer.statement import as_html, one_line, statement
from parc_jax.answer.written import written
from parc_jax.common.errors import InputError
from parc_jax.common.keys import generator
from parc_jax.common.lp.status import LPStatus
from parc_jax.common.sets.hpolytope import HPolytope
from parc_jax.common.sets.vertices import chebyshev_center
from parc_jax.learning.bound.counts import NoStatement, Risk
from parc_jax.learning.runs.files import write_atomic
from parc_jax.safe_set.corridors.best import best_plan
from parc_jax.safe_set.corridors.solid import Solid
from parc_jax.safe_set.corridors.union import SafeUnion

if TYPE_CHECKING:
    from parc_jax.drive.local.choice import Choice

CUT_AROUND = 20_000  # safe plans around which `with_polytopes` cuts
SPREAD_OUT = 6  # dimensions of (p0, k) up to which polytopes that nobody asked for are cut


class Answer(Findings):
    """What `Planner.solve` returns. All methods take and return float64 NumPy arrays.

    samples (n, n_p + n_k): safe starts and parameters, uniform over the safe set.
    proved: the independent checker accepted all that is returned. refused: samples, corridors and
    polytopes that it did not accept and that are therefore not in the answer. no_plan: when no draw
    was safe, what branch and bound says: proved that none is, or how much is undecided.
    uncertainty: what all plans withstand; `problem` and `model` are then the plain ones that allow
    for it. pose: where the robot is, where that was asked: all plans start there, and with a
    heading the scene is told in the robot's frame. question: all of it, as it was asked. looks: the
    one account of tests of plans of this answer, and of whatever comes of it.
    """

    def __repr__(self) -> str:
        return f"<{one_line(self)}>"

    def _repr_html_(self) -> str:
        return as_html(self)

    def with_polytopes(self, key: jax.Array, n: int = CUT_AROUND) -> "Answer":
        """This answer with its corridors cut into polytopes around n fresh safe plans, proved where
        this answer is. Its `coverage` is that of one look at 6,000 further plans.

        Corridors know no regions, polytopes do: they are many where parameters are.
        """
        cover, refused = cut.with_polytopes(self, key, n)
        return replace(self, cover=cover, refused=self.refused + refused)

    def in_polytopes(self) -> "Answer":
        """This answer with safe polytopes: itself where the query cut some, else with those that
        the first call cuts. Raises InputError beyond SPREAD_OUT dimensions of (p0, k), where
        `with_polytopes` must be asked.
        """
        return self._in_polytopes

    @cached_property
    def _in_polytopes(self) -> "Answer":
        if len(self.polytopes) or not len(self.corridors):
            return self
        n = self.model.n_k + (self.model.n_p if self.scene.at is None else 0)
        if n > SPREAD_OUT:
            raise InputError(
                f"expected at most {SPREAD_OUT} dimensions of (p0, k) for polytopes that were not "
                f"asked for; this answer has {n}. Use `sample`, `contains` and `best`, which need "
                "none, or cut them with `with_polytopes`."
            )
        return self.with_polytopes(jax.random.PRNGKey(0))

    @cached_property
    def _solids(self) -> list[Solid]:
        """The polytopes in the round; of an answer without any, those cut now."""
        plans = self._in_polytopes._plans
        if not isinstance(plans, SafeUnion):
            return []
        return [solid for solid in plans.solids if solid is not None]

    def safe_sets(self) -> list[HPolytope]:
        """Safe convex polytopes in (p0, k), each inside one region and one bin, redundant rows
        removed; in k alone where all plans have one start, `scene.at`. The first call cuts them
        where the query cut none, which may take seconds.
        """
        return [solid.polytope for solid in self._solids]

    def volumes(self) -> np.ndarray:
        """Volume of every polytope of `safe_sets` [units of p0 and k multiplied]; they may overlap
        inside a region.
        """
        return np.array([solid.volume for solid in self._solids])

    def volume(self, confidence: float = 0.99) -> tuple[float, float, float] | None:
        """Volume of the model's safe set: estimate and Clopper-Pearson interval, in units of p0 and
        k multiplied. Where safe plans are so rare that draws came from a place, of the part in it.

        None when nothing was drawn uniformly (the published search). The interval takes the number
        of draws as fixed.
        """
        return safe_volume(self.cover, confidence)

    @property
    def safe_share(self) -> SafeShare | None:
        """Share of all (p0, k) whose first point ends in the goal's box, whatever else the goal
        asks, or of all k from the one start, that is safe: the number to tune by. Estimate,
        Clopper-Pearson interval as of `volume`, and what the tube alone leaves. Of an answer around
        a place only what is safe in it is counted. None as of `volume`.
        """
        return safe_share(self)

    def contains(self, p0, k, of: Literal["polytopes", "corridors"] | None = None) -> np.ndarray:
        """Which plans are safe by what was found.

        p0: (b, n_p) [m] starts. k: (b, n_k) parameters.
        of: "polytopes", inside one of them; "corridors", keeps to one of them; None, of what
            `sample` draws from: polytopes, without any corridors.

        Returns bool (b,). Raises InputError.
        """
        plans = {
            None: lambda: self._plans,
            "polytopes": lambda: SafeUnion(self.scene, list(self.cover.polytopes)),
            "corridors": lambda: self._kept,
        }
        if of not in plans:
            raise InputError(
                f'contains: expected of="polytopes" or of="corridors"; got {of!r:.40}. Leave it '
                "out for what `sample` draws from."
            )
        return plans[of]().contains(*self._given("contains", p0, k))

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

    def path(self, p0, k) -> NominalPath:
        """Where the plan p0 (n_p,), k (n_k,) is predicted to go, with times and tube; in the frame
        of `model`, whose points, under an uncertainty of execution or heading, are copies of the
        robot's.

        Raises InputError for a plan outside of K. `save` writes it as .csv or .json.
        """
        starts, values = self._given("path", p0, k)
        if len(starts) != 1:
            raise InputError(f"path: expected one plan; got {len(starts)}. Ask one at a time.")
        return nominal_path(self.model, starts[0], values[0])

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
        """The plan (n_p + n_k,) of the safe set with the largest objective found, and its value: of
        all that corridors hold, where there are any, which is more than their polytopes do.

        objective: "clearance" [m]; "room", the least of clearance and of the margins of goal and
        start; a vector c for the linear c . (p0, k), exact at a vertex of `polytopes`; or a JAX
        function of p0 (n_p,), k (n_k,). A hand-picked k has no probabilistic statement: see
        `risk`.
        """
        named = callable(objective) or isinstance(objective, str)
        plans = self._kept if named and len(self.corridors) else self._plans
        return best_plan(plans, objective, generator(jax.random.PRNGKey(0) if key is None else key))

    def choose(
        self,
        objective="room",
        key: jax.Array | None = None,
        *,
        delta=None,
        looks: int | None = None,
    ) -> "Choice":
        """The one plan that is driven: the best for an objective, as in `best`. [T23]

        Its `statement()` says what is known of this plan without new runs; `Choice.run` and
        `Choice.claim_near` make runs, and each is a look. delta, looks: error probability of all
        looks at plans of this answer together, and how many there may be, 1e-3 and one unless the
        first choice declares others; kept by later ones, by this answer in polytopes and by its
        file. Raises InputError.
        """
        if self.uncertainty is not None:
            raise InputError(
                "choose: expected an answer without uncertainty, for its sentences are about one "
                "plan driven exactly; solve the same problem with uncertainty=None and choose "
                "from that."
            )
        account = self.looks.declare(delta, looks)
        plan, value = self.best(objective, key)
        from parc_jax.drive.local.choice import (
            Choice,  # it trains: whoever only asks needs no trainer
        )

        return Choice(plan, value, self.scene, account, self.solve)

    def safest(self) -> tuple[np.ndarray, float]:
        """Centre (n_p + n_k,) and radius of the largest ball, in (p0, k) units, inside one safe
        polytope.

        Its radius is room for state-estimation and command error: every plan in the ball is safe.
        """
        balls = [chebyshev_center(s) for s in self.safe_sets()]
        known = [(b.center, float(b.radius)) for b in balls if b.status == LPStatus.FEASIBLE]
        if not known:
            raise InputError("safest: expected an answer with safe polytopes; this one has none.")
        return max(known, key=lambda ball: ball[1])

    def share_of_k(self) -> float:
        """At least so much of K has a start in what `sample` draws from: Pi(T) from below, with
        99.9 % confidence. Starts are tried for a few ends in the goal alone, so where plans end in
        many places it may be far below the share; `contains` tells of single k. The first call
        tries thousands of k.
        """
        return self._share_of_k

    @cached_property
    def _share_of_k(self) -> float:
        share = self._plans.share_of_k()
        if self.uncertainty is None:
            return share
        return share * self.uncertainty.share_of_k(self.model.domain)

    @property
    def density(self) -> float:
        """Upper bound W of the density of k, relative to uniform on K, when plans are drawn by
        `sample`. Else infinite. [T34]

        Per unit of k a bin offers at most the box of end points in the goal less its error;
        `sample` spreads over the whole union, whose volume is at least the lower bound of the safe
        set's times the covered share.
        """
        return density_of_k(self)

    def risk(self) -> Risk | NoStatement:
        """What the claim promises for a plan drawn by `sample`: uniformly from the safe polytopes,
        or without any from all that the corridors hold. [T5, T18, T34]

        The density of such k relative to the claim's uniform law is at most `density`. For another
        law over k use `model.claim.risk`: with k itself uniform on the certified k-set,
        `share=answer.share_of_k()`.
        """
        return risk_of_draw(self)

    def statement(self) -> str:
        """The two sentences: (C) what is proved of the model and its tube, (E) what is known of the
        tube.
        """
        return statement(self)

    def to_json(self) -> dict:
        """The answer as certificates; numbers are strings, nothing in it has to be trusted but the
        tube.
        """
        return written(self)

    def save(self, path) -> Path:
        """Write answer.json; it appears complete or not at all. `parc-jax check` verifies it."""
        return write_atomic(path, json.dumps(self.to_json(), separators=(",", ":")).encode())
