"""A system's model: network and claim in one file; loading refuses incomplete or mixed ones."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import ArrayLike, Float

from parc_jax.common import struct
from parc_jax.common.arrays import once
from parc_jax.common.errors import InputError, check_kind, reading
from parc_jax.common.sets.box import Box
from parc_jax.common.spelling import counted
from parc_jax.learning.bound.claim import ErrorClaim, check_network, derived
from parc_jax.learning.bound.claim_file import claim_from_json
from parc_jax.learning.bound.error_set import ErrorTemplate
from parc_jax.learning.bound.fresh import identity_of
from parc_jax.learning.bound.statement import VALIDATED
from parc_jax.learning.bound.tube import Tube, tube_arrays, tube_from_arrays
from parc_jax.learning.labels import Labels, name_of
from parc_jax.learning.network.predict import Layout
from parc_jax.learning.network.relu import ReLUNetwork, relu_network
from parc_jax.learning.network.rounding import UNIT, RoundingBound, rounding_bound
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.runs.files import read_npz, rollouts_from_npz, rollouts_to_npz, write_npz
from parc_jax.learning.system import TimeGrid

FORMAT = "parc_jax.model/2"
HELD = "held_"  # begins names of the arrays of held-out recordings


@struct.dataclass
class TrajectoryModel:
    """A network and its claim. Build with `trajectory_model`, which validates.

    net: k -> (c_1 ... c_T, q). claim: its error bound, with system, K, time grid, points and
        rotation. held: the recordings that sized its tube, which test sets of one scene too [T42];
        None for a system that is run.
    """

    net: ReLUNetwork
    claim: ErrorClaim = struct.field(pytree_node=False)
    held: RolloutBatch | None = struct.field(pytree_node=False, default=None)

    @property
    def domain(self) -> Box:
        """K."""
        return self.claim.subject.domain

    @property
    def time(self) -> TimeGrid:
        """Knots and horizon."""
        return self.claim.subject.time

    @property
    def system(self) -> str:
        """Name of the black box it was learned from."""
        return self.claim.subject.system

    @property
    def labels(self) -> Labels:
        """Names of the coordinates."""
        return self.claim.subject.labels

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the robot's reference points."""
        return self.claim.subject.points

    @property
    def rotation(self) -> tuple[str, ...] | None:
        """Declared behaviour of the heading, as of `rotation_of`."""
        return self.claim.subject.rotation

    @property
    def given(self) -> tuple[int, ...]:
        """Axes of k that are measured at the start, as of `given_of`."""
        # older files of questions that copy the model have it in their ledger alone
        told = re.search(r"HIDDEN_START\(given (.*?)\)(; |$)", "; ".join(self.claim.assumptions))
        names, k = re.split(", | and ", told[1]) if told else [], self.labels.k
        return self.claim.subject.given or tuple(i for i, x in enumerate(k) if name_of(x) in names)

    @property
    def tube(self) -> Tube:
        """The tube of the claim."""
        return self.claim.tube

    @property
    def n_p(self) -> int:
        """Workspace dimension."""
        return self.tube.n_p

    @property
    def n_points(self) -> int:
        """Number of reference points."""
        return self.tube.n_points

    @property
    def n_c(self) -> int:
        """Number of columns: the coordinates of all reference points."""
        return self.tube.n_c

    @property
    def layout(self) -> Layout:
        """Layout of the network's outputs."""
        return self.tube.layout

    @property
    def n_q(self) -> int:
        """Number of further goal states."""
        return self.tube.n_q

    @property
    def n_k(self) -> int:
        """Number of manoeuvre parameters."""
        return self.domain.n

    def __repr__(self) -> str:
        size = (
            f"{counted(self.n_k, 'parameter')}, {self.time.t_f:g} s in "
            f"{counted(self.time.n_steps, 'interval')}"
        )
        return f"TrajectoryModel({self.system or 'unnamed'}: {size}, {self.net}, {self.claim})"

    def with_labels(self, given: Labels | Mapping[str, Sequence[str]]) -> "TrajectoryModel":
        """The model with other labels: `Labels`, or a mapping of some of p, q and k, as {"k":
        ("speed [m/s]", ...)}, in the same units. Raises InputError, also for another's name.
        """
        about = replace(self.claim.subject, given=self.given).with_labels(given)
        for part, names in self.labels._asdict().items():
            about.check_renamed("labels", part, names)
        # a ledger whose names are of no label keeps them
        told = [(*about.hidden, x)[0] if x[:7] == "HIDDEN_" else x for x in self.claim.assumptions]
        claim = derived(self.claim, subject=about, assumptions=(*told,))
        held = self.held and replace(self.held, labels=about.labels)
        return replace(self, claim=claim, held=held)

    def save(self, path) -> Path:
        """Write one .npz; it appears complete or not at all. Raises InputError as `check_model`."""
        check_model(self)
        meta = {"format": FORMAT, "claim": self.claim.to_json()}
        arrays = {f"W{i}": W for i, W in enumerate(self.net.weights)}
        arrays |= {f"b{i}": b for i, b in enumerate(self.net.biases)}
        arrays |= tube_arrays(self.tube)
        held = {} if self.held is None else rollouts_to_npz(self.held)
        arrays |= {f"{HELD}{name}": array for name, array in held.items()}
        return write_npz(path, {"meta": np.array(json.dumps(meta)), **arrays}, compressed=True)


def trajectory_model(net: ReLUNetwork, claim: ErrorClaim) -> TrajectoryModel:
    """Validated model; system, K, time grid and points are those of the claim. Raises InputError
    for the claim of another network, or with a part from elsewhere.
    """
    model = TrajectoryModel(net, claim)
    check_model(model)
    return model


def check_model(model: TrajectoryModel) -> None:
    """Refuse a network or a claim with a part from elsewhere, and a claim about one set in one
    scene, which is valid in its answer alone. Raises InputError.
    """
    check_kind("model", model, TrajectoryModel)
    if model.claim.kind == VALIDATED:
        raise InputError(
            "model: expected a claim about all of K; this one is about one set of plans in one "
            "scene, and about draws from it. Take the model that the set was made with."
        )
    check_parts(model)


def check_parts(model: TrajectoryModel) -> None:
    """Refuse a network or a claim with a part from elsewhere. Raises InputError."""
    net, claim = model.net, model.claim
    check_network(claim, net)
    layout, n_q = claim.tube.layout, claim.tube.n_q
    if net.n_out != layout.n_offsets + n_q:
        raise InputError(
            f"model: expected {layout.n_offsets} + {n_q} network outputs for this tube (offsets of "
            f"{layout.n_points} points in {layout.n_p} dimensions at {layout.n_steps} knots after "
            f"the first, further states); got {net.n_out}."
        )
    about, held = claim.subject.labels, model.held
    if held and (about, claim.evidence.get("held")) != (held.subject.labels, identity_of(held)):
        raise InputError(
            "model: expected the recordings that its claim held out, by its labels, all of them as "
            "they were; got others. Leave them out: held=None."
        )
    if net.n_in != claim.domain.n:
        raise InputError(
            f"model: expected a network with {claim.domain.n} inputs, as K has; got {net.n_in}."
        )


def load(path, system: str | None = None) -> TrajectoryModel:
    """Read a model written by `save`. With `system`, refuse one of another. Raises InputError."""
    check_kind("load: system, the name of one", system, str | None)
    if str(path).endswith(".json"):
        raise InputError(
            f"{path}: expected a model (.npz of `TrajectoryModel.save`); a .json is an answer, a "
            "scene or an episode. Try pj.load_answer(path), pj.exchange.load_problem(path) or "
            "`parc-jax check`."
        )
    file = read_npz(path)
    with reading(path, "a file of `TrajectoryModel.save`"):
        meta = json.loads(str(file["meta"]))
        if meta["format"] != FORMAT:
            raise InputError(
                f"{path}: expected a model of format {FORMAT}; got {meta['format']!r}. Learn anew."
            )
        layers = sum(name.startswith("W") for name in file)
        net = relu_network(
            [file[f"W{i}"] for i in range(layers)], [file[f"b{i}"] for i in range(layers)]
        )
        n_points = len(meta["claim"]["subject"]["points"])
        claim = claim_from_json(meta["claim"], tube_from_arrays(file, net.n_in, n_points))
    if system is not None and claim.subject.system != system:
        raise InputError(
            f"{path}: expected a model of {system!r}; it was learned from {claim.subject.system!r}."
        )
    held = {name[len(HELD) :]: file[name] for name in file if name.startswith(HELD)}
    model = TrajectoryModel(net, claim, rollouts_from_npz(path, held) if held else None)
    check_model(model)
    return model


def float_slack(model: TrajectoryModel, size: Float[ArrayLike, "..."]):
    """[T11] One number covering all rounding between the exact verdict and its float64 evaluation.

    size: (...) [m] largest goal bound plus largest corner plus radius, of one scene or of many.
    Network error, the sums p0 + c and w.p - h (fewer than 32 operations, more only for a row of a
    goal over more coordinates, on numbers no larger than the sizes together), corners and reaches
    rounded to nearest; all per unit of |w|_1. Supports between faces are sums of products with an
    inverse: condition at most about 60 (FLAT), so 8,192 units of the sum of their terms pay for it.
    """
    bound, widest, between_faces = once(model, _rounding)
    longest = max(32, model.n_c + model.n_q + 3)  # operations one after another: a row of the goal
    sizes = 4 * bound.magnitude.max() + size + widest
    return 4 * bound.error.max() + 2 * longest * UNIT * sizes + 8192 * UNIT * between_faces


def _rounding(model: TrajectoryModel) -> tuple[RoundingBound, float, float]:
    """Of the network; the largest half width of the tube [m]; the largest sum of the terms of a
    support between its faces, 0 for boxes.
    """
    tube, claimed = model.tube, model.tube.claimed  # in the other bins nothing is ever safe
    widest = max(tube.interval[claimed].max(initial=0.0), tube.final[claimed].max(initial=0.0))
    sets = (tube.errors, tube.final_errors)
    sizes = [e.largest[claimed] for e in sets if isinstance(e, ErrorTemplate)]
    terms = max((float(size.max(initial=0.0)) for size in sizes), default=0.0)
    return rounding_bound(model.net, model.domain), widest, terms
