"""A model of a small box of K, and a problem proved again under its claim. [T1, T23]

Fresh runs on the box, a small network, and an error bound about the box alone.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.answer.looks import Look, Looks
from parc_jax.answer.risk import measured_of
from parc_jax.common.errors import InputError, expected
from parc_jax.common.keys import Stage, folded, stream
from parc_jax.common.options import part_of
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import rounded_down, rounded_up
from parc_jax.drive.local.safe_box import SafeBox, safe_box, share_of, sides_of
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.bound.counts import NoStatement, Risk
from parc_jax.learning.bound.pipeline import STORED, SystemRuns, bound_errors
from parc_jax.learning.bound.settings import BoundSettings, Intersample, Sizing
from parc_jax.learning.bound.start_gap import StartTrial
from parc_jax.learning.bound.statement import assumes, count_of, probability
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel, trajectory_model
from parc_jax.learning.network.fit import Training
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.runs.joined import concatenate
from parc_jax.learning.runs.law import BOX, law_of, law_spec
from parc_jax.learning.runs.simulate import uniform
from parc_jax.learning.system import System, check_system
from parc_jax.learning.systems.chained import Chained, hand_over_of
from parc_jax.planner import Planner
from parc_jax.problem.robust.nominal import Query
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.outline import require_same
from parc_jax.safe_set.verdict.scene import Scene

BINS = 1  # per axis: the error hardly ever changes within so small a box
NARROWER = 1.05  # [1] least factor by which a tube that is called narrower is so
_TRIAL = 2**32 - 1  # number within the DRIVEN stream, behind those of looks and pilot samples


@dataclass(frozen=True)
class Local(Sizing, Training):
    """Sizes of a local claim: training, by default of an affine map, and error bound."""

    rollouts: int = 4000
    profile_runs: int | None = 6000
    hidden: tuple[int, ...] = ()
    seeds: int = 4
    steps: int = 1500
    share: float = 2e-4
    """Share of K that the box takes."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.share <= 1:
            raise InputError(f"local claim: expected a share of K in (0, 1]; got {self.share}.")


class Driven(NamedTuple):
    """A plan (n_p + n_k,) in its scene, as the results of its runs keep it."""

    scene: Scene
    plan: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Near:
    """A claim about a box N of k alone, and the problem proved again under it. [T23]

    model: of N alone. look: spent on it. share: exact, of K that N takes. at_end, on_the_way:
    geometric mean factors by which the local tube is narrower than that over K; infinite where the
    latter has no claim. answer: to the same problem under the local tube; None where that has no
    claim. proved: a large box in N of plans from the start of a chosen plan, all proved safe
    under the local tube, or None. of: the plan that was chosen.
    """

    model: TrajectoryModel = field(repr=False)
    look: Look
    share: Fraction
    at_end: float
    on_the_way: float
    answer: Answer | None = field(default=None, repr=False)
    proved: SafeBox | None = field(default=None, repr=False)
    of: Driven | None = field(default=None, repr=False)

    def around(self, p0: np.ndarray, k: np.ndarray) -> "Near":
        """With the proved box around the plan p0 (n_p,), k (n_k,)."""
        if self.answer is None:
            return self
        return replace(self, proved=safe_box(self.answer.scene, p0, k, self.model.domain))

    @property
    def held(self) -> Fraction:
        """Exact share of N that the proved box takes; 0 without one."""
        return Fraction(0) if self.proved is None else self.proved.share

    def risk(self) -> Risk | NoStatement:
        """P(a run leaves the local tube), k uniform on the proved box: eps / its share of N; every
        run of such a k inside the tube succeeds. [T5, T23]
        """
        if self.proved is None or self.answer is None:
            return NoStatement("no box around the plan was proved safe under the local tube")
        none = measured_of(self.answer.scene.nominal.told.model)
        return none or self.model.claim.risk(share=self.held)

    @property
    def is_narrower(self) -> bool:
        """Whether the local claim gains anything: at the end or on the way."""
        return max(self.at_end, self.on_the_way) >= NARROWER

    def details(self) -> str:
        """The sentence (D ii)."""
        claim, p = self.model.claim, self.model.claim.premises
        box = sides_of(self.model.labels.k, self.model.domain)
        where = f"Near it: k in N = {box}, {rounded_up(100 * self.share, 3)} % of K."
        if not claim.tube.claimed.any():
            return f"{where} {claim.details()}"
        lines = [
            f"{where} With confidence {self.look.sure}{self.look.numbered(' (look', ')')} over "
            f"{count_of(p)[0]:,} fresh runs made on N alone after N was chosen, {p['law']} leaves "
            f"the local tube in its {p['lasts']} with probability at most "
            f"{probability(p['eps'])}. Of these runs {p['failed']:,} failed; discards, fixed "
            f"beforehand: {p['discards']:,}.",
            self._about_width(),
        ]
        risk = self.risk()
        if isinstance(risk, NoStatement):
            lines.append(f"Of driving near this plan: no statement, since {risk.reason}.")
        else:
            part = f"{sides_of(self.model.labels.k, self.proved)}, that takes "
            S = "N" if self.held == 1 else f"{part}{rounded_down(100 * self.held, 3)} % of N"
            lines.append(
                f"From this start every k of a box S = {S} is proved safe under "
                "the local tube. Driven with k uniform on S, the run fails with probability at "
                f"most {rounded_up(risk.bound)}."
            )
        return " ".join([*lines, assumes(p)])

    def _about_width(self) -> str:
        at_end, on_the_way = (
            "infinity" if np.isinf(x) else rounded_down(x) for x in (self.at_end, self.on_the_way)
        )
        if not self.is_narrower:
            return (
                "The local tube is NOT narrower than the one over all of K "
                f"({at_end} at the end, {on_the_way} on the way): this claim gains "
                "nothing but a law of k near the plan."
            )
        return (
            f"The local tube is narrower than the one over all of K by a factor of {at_end} "
            f"at the end and {on_the_way} on the way."
        )


def answered_near(
    question: Query,
    model: TrajectoryModel,
    look: Look,
    looks: Looks,
    key: jax.Array,
    settings: Settings | None,
) -> Near:
    """The answer to a query again, under the model of a box of its K. looks: the account, of which
    `look` was spent. key: its SEARCH stream is used.
    """
    # tests of the plan's other looks may have decided that these runs were made
    said = (*model.claim.assumptions, *look.ledger[1:])
    model = model.replace(claim=derived(model.claim, assumptions=said))
    whole = question.model
    share = share_of(model.domain, whole.domain)
    near = Near(model, look, share, *_narrowing(whole.tube, model.tube, model.domain))
    if not model.tube.claimed.any():
        return near
    query = question.of(model)
    at = None if query.pose is None else query.pose.values
    answer = Planner(model).solve(query.problem, key, settings, at=at)
    # the same account of looks: tests of plans of the new answer are counted with those before
    return replace(near, answer=replace(answer, looks=looks))


def require_begins(call: str, system: System, model: TrajectoryModel) -> None:
    """Refuse another system, and chains: runs of a k that is handed over begin settled, as no run
    of a chain does. [T37] Raises InputError.
    """
    check_system(system)
    require_same(system, model)
    if isinstance(system, Chained) or hand_over_of(model.claim.law.k_law):
        raise InputError(
            f"{call}: expected a system and a claim without chains; runs of a chosen k begin "
            "settled, those of chains in motion. Learn the system itself, or watch drives: monitor."
        )


def checked_local(call: str, system: System, model: TrajectoryModel, local: Local | None) -> Local:
    """The sizes, or the default ones. Raises InputError for others, and as `require_begins`."""
    require_begins(call, system, model)
    local = Local() if local is None else local
    if not isinstance(local, Local):
        raise InputError(expected(call, "a Local", local, "pj.drive.Local(eps=1e-3)"))
    return local


def key_of_trial(key: jax.Array) -> jax.Array:
    """A part of the DRIVEN stream of `key` that no look uses, for trials of starts before it."""
    return folded(stream(key, Stage.DRIVEN), _TRIAL)


def bounded_near(
    net: ReLUNetwork,
    runs: "LocalRuns",
    train: RolloutBatch,
    delta: Fraction,
    local: Local,
    start: StartTrial,
    between: Intersample,
    profile: Tube | None = None,
) -> TrajectoryModel:
    """The model of a network fitted to `train`, its error bounded with confidence 1 - delta by
    fresh runs on their box. [T1, T23]

    start: result of `try_starts`. between: declared by the claim over K about the time between
    records. profile: shape of its tube, None to learn it. Raises InputError.
    """
    about = {"delta": delta, "bins": runs.bins, "intersample": between}
    bound = BoundSettings(**part_of(local, Sizing), **about)
    (claim,) = bound_errors(net, runs, train, bound, start, profile=profile)
    return trajectory_model(net, claim)


@dataclass(frozen=True, eq=False)
class LocalRuns(SystemRuns):
    """Runs of a system on a box N inside K, of a fresh key, the first of TRAIN for the network. K
    of the system stays, so nothing is compiled again.
    """

    box: Box

    @property
    def bins(self) -> tuple[int, ...]:
        """Bins of the tube per axis of the box."""
        return (BINS,) * self.box.n

    def train(self) -> RolloutBatch:
        """The training runs."""
        return concatenate(self._stream(self.first_row, Stage.TRAIN, "", 0), self.first_row)

    def _stream(self, n: int, stage: Stage, name: str, first_row: int) -> Iterator[RolloutBatch]:
        ends = self.box.lo, self.box.hi  # alone: runs are made again by the content of `near`

        def near(key: jax.Array):
            # converted in here, where float64 is on: in float32 a small box has few values
            return uniform(key, *(jnp.asarray(x, jnp.float64) for x in ends))

        whole = law_of(self.system)
        law = law_spec(whole.generator, self.box, "uniform", dict(whole.parameters) | {BOX: "N"})
        options = {"k": near, "first_row": first_row, "dtype": STORED, "quiet": self.quiet}
        for batch in stream_rollouts(self.system, self.key, n, stage, **options):
            yield replace(batch, domain=self.box, law=law)


def _narrowing(whole: Tube, local: Tube, box: Box) -> tuple[float, float]:
    """Geometric mean factors at the end and on the way by which `local` is narrower on a box.

    whole: the tube over K, its widest of the bins that meet the box.
    """
    corners = (whole.bin_box(number) for number in range(whole.n_bins))
    bins = [b for b, (lo, hi) in enumerate(corners) if ((lo <= box.hi) & (hi >= box.lo)).all()]
    path, end = whole.widest(np.array(bins))
    local_path, local_end = local.widest()
    return _factor(end, local_end), _factor(path, local_path)


def _factor(wide: np.ndarray, narrow: np.ndarray) -> float:
    if not np.isfinite(wide).all():
        return float("inf")
    return 0.0 if not np.isfinite(narrow).all() else float(np.exp(np.mean(np.log(wide / narrow))))
