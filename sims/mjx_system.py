"""A MuJoCo model file with a controller, stepped by MJX, as a black box."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import Box
from parc_jax.learning.system import ONE_POINT, TimeGrid, Trajectory, check_points
from sims.quiet import lenient, quiet_import


@dataclass(frozen=True, eq=False)
class MJXSystem:
    """A MuJoCo model under a controller that k steers. Build with `mjx_system`, which validates.

    The first n_p joint coordinates are the workspace position, so they must be slide joints (or the
    first three of a free joint). Where there are sites, the reference points are these instead.
    Deterministic unless `start` draws something from the key.
    """

    name: str
    domain: Box
    time: TimeGrid
    n_p: int
    n_q: int
    model: Any
    steps: int
    controller: Callable
    final: Callable
    start: Callable
    q_labels: tuple[str, ...] | None = None
    k_labels: tuple[str, ...] | None = None
    points: tuple[str, ...] = ONE_POINT
    sites: tuple[int, ...] | None = None

    def rollout(self, key: jax.Array, k: jax.Array) -> Trajectory:
        """One run from the model's initial state."""
        return self.rollout_from(key, k, jnp.zeros(self.n_p, k.dtype))

    def rollout_from(self, key: jax.Array, k: jax.Array, p0: jax.Array) -> Trajectory:
        """One run with the position moved by p0 (n_p,) [m]; p is relative to it."""
        from mujoco import mjx

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
        """Of the reference points: (n_p,) of one, (m, n_p) of sites."""
        from mujoco import mjx

        if self.sites is None:
            return data.qpos[: self.n_p]
        # a step leaves the sites where they were before it
        now = mjx.kinematics(model, data)
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
    time.dt_record must be a whole number of the model's time steps. points: names of sites that
    become the reference points, the first of which starts at the origin; None = the first n_p joint
    coordinates. q_labels, k_labels: names with units, such as "speed [m/s]".
    Raises InputError.
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
    steps = time.dt_record / compiled.opt.timestep
    if abs(steps - round(steps)) > 1e-9 * steps:
        raise InputError(
            "MuJoCo model: expected dt_record to be a whole number of its time steps of "
            f"{compiled.opt.timestep} s; "
            f"got {time.dt_record} s."
        )
    if compiled.nq < n_p:
        raise InputError(
            f"MuJoCo model: expected at least {n_p} joint coordinates; it has {compiled.nq}."
        )
    name = name or ("mujoco" if text.lstrip().startswith("<") else Path(text).stem)
    run = (compiled, round(steps), controller, final, start)
    system = MJXSystem(name, domain, time, n_p, n_q, *run, q_labels, k_labels)
    if points is None:
        return system
    named = check_points(name, points)
    known = [compiled.site(i).name for i in range(compiled.nsite)]
    unknown = [point for point in named if point not in known]
    if unknown:
        raise InputError(
            f"{name}: expected points that are sites of the MuJoCo model ({', '.join(known)}); got "
            f"{unknown[0]!r}."
        )
    return replace(system, points=named, sites=tuple(known.index(point) for point in named))
