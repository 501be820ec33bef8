"""A MuJoCo model file with a controller, stepped by MJX, as a black box."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.learning.system import ONE_POINT, TimeGrid, Trajectory, check_points
from parc_jax.learning.systems.content import with_digest
from parc_jax.learning.systems.user_code import blamed
from sims.quiet import lenient, quiet_import

SAME_PLACE = 1e-9  # [m] between places that float64 kinematics may tell of one


class Content(Mapping):
    """Numbers, and name and digest of other parts, as they are at each look."""

    def __init__(self, name: str, parts: dict[str, Any]):
        self.name, self.parts = name, parts

    def __getitem__(self, what: str) -> str:
        part = self.parts[what]
        if isinstance(part, int | tuple):
            return str(part)
        return with_digest(getattr(part, "__name__", self.name), part)

    def __iter__(self):
        return iter(self.parts)

    def __len__(self) -> int:
        return len(self.parts)


@dataclass(frozen=True, eq=False)
class MJXSystem:
    """A MuJoCo model under a controller that k steers. Build with `mjx_system`, which validates.

    Reference points are sites, or the body that the n_p-th joint coordinate moves; p is their place
    in MuJoCo's world. Deterministic unless `start` draws something from the key. law: content of
    all that runs, as it was built and once asked; now: as it is.
    """

    name: str
    domain: Box
    time: TimeGrid
    n_p: int
    n_q: int
    model: Any
    controller: Callable
    final: Callable
    start: Callable
    body: int
    q_labels: tuple[str, ...] | None = None
    k_labels: tuple[str, ...] | None = None
    points: tuple[str, ...] = ONE_POINT
    sites: tuple[int, ...] | None = None
    law: dict[str, str] = field(init=False)
    now: Content = field(init=False)

    def __post_init__(self) -> None:
        places = "body" if self.sites is None else "sites"
        runs = ("controller", "final", "start", "model", places)
        parts = {what: getattr(self, what) for what in runs}
        object.__setattr__(self, "now", Content(self.name, parts))
        step, dt = self.model.opt.timestep, self.time.dt_record
        if abs(dt / step - self.steps) > 1e-9 * dt / step:
            raise InputError(
                "MuJoCo model: expected dt_record to be a whole number of its time steps of "
                f"{step} s; got {dt} s."
            )
        _require_moved(self)
        key, k = jax.random.PRNGKey(0), jnp.zeros(self.domain.n)
        with blamed(f"{self.name}: expected functions that can be traced"):
            # some fill what they keep once they are asked
            controls, _ = jax.eval_shape(self._asked, key, k)
        wanted, got = (self.model.nu,), getattr(controls, "shape", type(controls).__name__)
        if got != wanted:
            raise InputError(
                f"{self.name}: controller: expected (n_u,), here an array of shape {wanted}; got "
                f"{got}."
            )
        object.__setattr__(self, "law", dict(self.now))

    def _asked(self, key: jax.Array, k: jax.Array) -> tuple:
        """What each function says, of the start of a run."""
        from mujoco import mjx

        with lenient():
            data = self.start(key, k, mjx.make_data(mjx.put_model(self.model)))
            controls = self.controller(data.qpos, data.qvel, data.time, k)
            return controls, self.final(data.qpos, data.qvel)

    @property
    def steps(self) -> int:
        """Steps of the model from one record to the next."""
        return round(self.time.dt_record / self.model.opt.timestep)

    def rollout(self, key: jax.Array, k: jax.Array) -> Trajectory:
        """One run from the model's initial state."""
        return self.rollout_from(key, k, jnp.zeros(self.n_p, k.dtype))

    def rollout_from(self, key: jax.Array, k: jax.Array, p0: jax.Array) -> Trajectory:
        """One run with the start moved by p0 (n_p,) [m], as `_require_moved` saw; p is relative."""
        from mujoco import mjx

        if self.now != self.law:
            raise InputError(
                f"{self.name}: expected the model and its functions as they were built; one was "
                "changed since, and is another robot. Build a system with `mjx_system` of that."
            )
        with lenient():
            model = mjx.put_model(self.model)
            data = self.start(key, k, mjx.make_data(model))
            data = data.replace(qpos=data.qpos.at[: self.n_p].add(p0))
            start = self._places(model, data)
            home = start[:1] if start.ndim == 2 else start

            def step(data, _):
                data = data.replace(ctrl=self.controller(data.qpos, data.qvel, data.time, k))
                return mjx.step(model, data), None

            def record(data, _):
                data, _ = jax.lax.scan(step, data, length=self.steps)
                return data, self._places(model, data) - home

            data, p = jax.lax.scan(record, data, length=self.time.n_record)
            p = jnp.concatenate([(start - home)[None], p])
            return Trajectory(
                p, jnp.reshape(self.final(data.qpos, data.qvel), (self.n_q,)).astype(p.dtype)
            )

    def _places(self, model, data) -> jax.Array:
        """Of the reference points in the world: (n_p,) of the body, (m, n_p) of sites."""
        from mujoco import mjx

        # a step leaves bodies and sites where they were before it
        now = mjx.kinematics(model, data)
        if self.sites is None:
            return now.xpos[self.body, : self.n_p]
        return now.site_xpos[jnp.array(self.sites), : self.n_p]


def mjx_system(
    model,
    controller: Callable,
    domain: Box,
    time: TimeGrid,
    *,
    n_p: int = 2,
    n_q: int = 0,
    final: Callable = lambda qpos, qvel: qpos[:0],
    start: Callable = lambda key, k, data: data,
    name: str | None = None,
    points: Sequence[str] | None = None,
    q_labels: Sequence[str] | None = None,
    k_labels: Sequence[str] | None = None,
) -> MJXSystem:
    """A black box from a MuJoCo model.

    model: path of an MJCF file, or its text. controller: (qpos, qvel, time, k (n_k,)) -> ctrl
    (n_u,), traceable, held over one step of the model. final: (qpos, qvel) -> q (n_q,). start:
    (key, k, data) -> data, the initial state and every disturbance that is drawn per run.
    time.dt_record must be a whole number of the model's time steps. n_p: so many joint coordinates,
    the first ones, must move all points along the axes of the world, as slide joints or a free one
    may. points: names of sites that become the reference points, the first of which starts at the
    origin; None = the body that the n_p-th coordinate moves. q_labels, k_labels: names with units,
    such as "speed [m/s]". The law has the content of the compiled model, of the functions once they
    were asked, and which places p tells. Raises InputError.
    """
    import mujoco

    quiet_import("mujoco.mjx")
    text = str(model)
    try:
        if text.lstrip().startswith("<"):
            compiled = mujoco.MjModel.from_xml_string(text)
        else:
            compiled = mujoco.MjModel.from_xml_path(text)
    except ValueError as error:
        raise InputError(f"MuJoCo model: expected an MJCF file or its text; {error}") from None
    if not n_p <= min(3, compiled.nq):
        raise InputError(
            f"MuJoCo model: expected n_p up to 3 and at least {n_p} joint coordinates; it has "
            f"{compiled.nq}."
        )
    name = name or ("mujoco" if text.lstrip().startswith("<") else Path(text).stem)
    joint = [j for j in range(compiled.njnt) if compiled.jnt_qposadr[j] < n_p][-1]
    run = (compiled, controller, final, start, int(compiled.jnt_bodyid[joint]))
    about = name, domain, time, n_p, n_q, *run, q_labels, k_labels
    if points is None:
        return MJXSystem(*about)
    named = check_points(name, points)
    known = [compiled.site(i).name for i in range(compiled.nsite)]
    unknown = [point for point in named if point not in known]
    if unknown:
        raise InputError(
            f"{name}: expected points that are sites of the MuJoCo model ({', '.join(known)}); got "
            f"{unknown[0]!r}."
        )
    return MJXSystem(*about, named, tuple(known.index(point) for point in named))


def _require_moved(system: MJXSystem) -> None:
    """Refuse a model whose first joint coordinates do not move its points along the world's axes,
    each by as much, wherever its joints stand. Raises InputError.
    """
    import mujoco

    model, n = system.model, system.n_p
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    one = system.sites is None
    places, rows = (data.xpos, [system.body]) if one else (data.site_xpos, list(system.sites))
    names = [model.body(system.body).name or "body"] if one else system.points
    for axis in [*range(n)] * 3:
        data.qpos[:] = model.qpos0
        mujoco.mj_integratePos(model, data.qpos, rng.normal(size=model.nv), 1.0)
        mujoco.mj_kinematics(model, data)
        before = places[rows]
        data.qpos[axis] += 1.0
        mujoco.mj_kinematics(model, data)
        for name, moved in zip(names, places[rows] - before, strict=True):
            if np.abs(moved - np.eye(3)[axis]).max() > SAME_PLACE:
                raise InputError(
                    f"{system.name}: expected joint coordinates of which {n} move the robot along "
                    f"{', '.join('xyz'[:n])} of the world; number {axis + 1}, raised by 1, moves "
                    f"{name} by ({', '.join(f'{x:.3g}' for x in moved)}) m. Put slide joints along "
                    "the world's axes, or a free joint, first, in a body that is not turned."
                )
