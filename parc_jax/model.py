"""The model of a system: network, claim, domain, time. One file holds it; loading refuses anything
incomplete.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from flax import struct

from parc_jax.claim.claim import ErrorClaim, check_tube, claim_from_json
from parc_jax.claim.tube import Tube
from parc_jax.claim.tube_file import tube_arrays, tube_from_arrays
from parc_jax.errors import InputError
from parc_jax.labels import Labels
from parc_jax.labels import labels as valid_labels
from parc_jax.network.predict import Layout
from parc_jax.network.relu import ReLUNetwork, relu_network
from parc_jax.rollout.files import read_npz, write_npz
from parc_jax.sets.box import Box, box
from parc_jax.spelling import counted
from parc_jax.system import ONE_POINT, TimeGrid, check_rotation, time_grid

FORMAT = "parc_jax.model/1"


@struct.dataclass
class TrajectoryModel:
    """What a query needs to know of a system. Build with `trajectory_model`, which validates.

    net: k -> (c_1 ... c_T, q). claim: what its error bound states. domain: K. time: knots and
        horizon.
    system: name of the black box it was learned from. labels: what the coordinates are called.
    points: names of the robot's reference points. rotation: what its system declares of the
    heading, as `rotation_of` has it.
    """

    net: ReLUNetwork
    claim: ErrorClaim = struct.field(pytree_node=False)
    domain: Box
    time: TimeGrid
    system: str = struct.field(pytree_node=False, default="")
    labels: Labels = struct.field(pytree_node=False, default=Labels((), (), ()))
    points: tuple[str, ...] = struct.field(pytree_node=False, default=ONE_POINT)
    rotation: tuple[str, ...] | None = struct.field(pytree_node=False, default=None)

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
        """Of the network's outputs."""
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

    def save(self, path) -> Path:
        """Write one .npz; it appears complete or not at all."""
        meta = {
            "format": FORMAT,
            "system": self.system,
            "claim": self.claim.to_json(),
            "time": [self.time.dt, self.time.t_f, self.time.dt_record],
            "labels": self.labels._asdict(),
            "points": list(self.points),
        }
        if self.rotation is not None:
            meta["rotation"] = list(self.rotation)
        arrays = {f"W{i}": W for i, W in enumerate(self.net.weights)}
        arrays |= {f"b{i}": b for i, b in enumerate(self.net.biases)}
        arrays |= tube_arrays(self.tube) | {"lo": self.domain.lo, "hi": self.domain.hi}
        return write_npz(path, {"meta": np.array(json.dumps(meta)), **arrays})


def trajectory_model(
    net: ReLUNetwork,
    claim: ErrorClaim,
    domain: Box,
    time: TimeGrid,
    system: str = "",
    labels: Labels | dict | None = None,
    points: Sequence[str] | None = None,
    rotation: Sequence[str] | None = None,
):
    """Validated model. Raises InputError that names the two parts that do not fit.

    labels: what the coordinates are called, as `labels_of(system)` or {"k": ("speed [m/s]", ...)};
    None leaves the plain ones. points: names of the robot's reference points, None where it has
    only one. rotation: as of `rotation_of(system)`.
    """
    check_tube(claim)
    measured = claim.evidence.get("network")
    if measured is not None and measured != net.hash:
        raise InputError(
            f"model: expected the network its claim was measured on ({measured[:12]}); got another "
            "one "
            f"({net.hash[:12]}). Bound the error of this network anew."
        )
    layout = claim.tube.layout
    n_q = claim.tube.n_q
    if time.n_steps != layout.n_steps:
        raise InputError(
            f"model: expected a tube with {time.n_steps} intervals, as the time grid has; got "
            f"{layout.n_steps}."
        )
    points = ONE_POINT if points is None else tuple(points)
    if len(points) != layout.n_points:
        raise InputError(
            f"model: expected the names of {layout.n_points} reference points, as the tube has; "
            f"got {len(points)}."
        )
    if net.n_out != layout.n_offsets + n_q:
        raise InputError(
            f"model: expected {layout.n_offsets} + {n_q} network outputs for this tube (offsets of "
            f"{layout.n_points} points in {layout.n_p} dimensions at {layout.n_steps} knots after "
            f"the first, further states); got {net.n_out}."
        )
    if net.n_in != domain.n:
        raise InputError(
            f"model: expected a network with {domain.n} inputs, as the domain has; got {net.n_in}."
        )
    for axis, edge in enumerate(claim.tube.edges):
        if edge[0] != domain.lo[axis] or edge[-1] != domain.hi[axis]:
            raise InputError(
                f"model: expected the tube's bins to span the domain; axis {axis} has bins over "
                f"[{edge[0]:g}, {edge[-1]:g}] but K is [{domain.lo[axis]:g}, {domain.hi[axis]:g}]."
            )
    given = labels._asdict() if isinstance(labels, Labels) else labels or {}
    named = valid_labels(layout.n_p, n_q, domain.n, **given)
    if rotation is not None:
        rotation = check_rotation("model", rotation, layout.n_p, n_q)
    return TrajectoryModel(net, claim, domain, time, system, named, points, rotation)


def load(path, system: str | None = None) -> TrajectoryModel:
    """Read a model written by `save`. With `system`, refuse a model of another system. Raises
    InputError.
    """
    if Path(path).suffix == ".json":
        raise InputError(
            f"{path}: expected a model (.npz of `TrajectoryModel.save`); a .json file is an answer "
            "or a scene. Try pj.load_answer(path) or pj.load_problem(path)."
        )
    file = read_npz(path)
    try:
        meta = json.loads(str(file["meta"]))
        if meta["format"] != FORMAT:
            raise InputError(
                f"{path}: expected a model of format {FORMAT}; got {meta['format']!r}."
            )
        layers = sum(name.startswith("W") for name in file)
        net = relu_network(
            [file[f"W{i}"] for i in range(layers)], [file[f"b{i}"] for i in range(layers)]
        )
        domain = box(file["lo"], file["hi"])
        points = tuple(meta.get("points", ONE_POINT))
        error_tube = tube_from_arrays(file, domain.n, len(points))
        claim = claim_from_json(meta["claim"], error_tube)
        time = time_grid(*meta["time"])
    except (KeyError, TypeError, json.JSONDecodeError) as error:
        raise InputError(
            f"{path}: expected a file of `TrajectoryModel.save`; {type(error).__name__}: {error}. "
            "Save it again."
        ) from None
    if system is not None and meta["system"] != system:
        raise InputError(
            f"{path}: expected a model of {system!r}; it was learned from {meta['system']!r}."
        )
    return trajectory_model(
        net,
        claim,
        domain,
        time,
        meta["system"],
        meta.get("labels"),
        points,
        meta.get("rotation"),
    )
