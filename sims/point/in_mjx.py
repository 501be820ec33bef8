"""What the shield costs on top of MJX's own step, for a batch of Points in one jitted call:

    python -m sims.point.in_mjx --robots 1024

Full thrust towards a goal among the hazards of as many worlds of level 1 (no vases). Prints the
time of a step of all robots with and without the shield (of the processor; on an accelerator on the
wall), and whether any touched.
"""

import time
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco import mjx

import parc_jax as pj
from parc_jax.common.spelling import rounded_down
from sims.point import model, sensing
from sims.point.manoeuvre import speeds_of
from sims.point.world import HAZARD, LEVELS, STEP, SUBSTEPS, XML, World


@dataclass(frozen=True)
class Options:
    """How many."""

    robots: int = 1024
    steps: int = 10
    """Of the environment, in one call."""
    calls: int = 3


def main(options: Options) -> None:
    """Measure, and print."""
    worlds = [World(LEVELS[1], seed) for seed in range(options.robots)]
    hazards = jnp.array([world.hazards - world.start for world in worlds])
    goals = jnp.array([world.layout["goal"] - world.start for world in worlds])
    square = sensing.DOT * jnp.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    corners, there = hazards[:, :, None] + square, jnp.ones(hazards.shape[:2], bool)
    shield = pj.drive.BatchShield(model(), **sensing.batch_door())
    engine = mjx.put_model(mujoco.MjModel.from_xml_path(str(XML)))

    def measured(data):
        pose = data.qpos[:, :3]
        return pose, speeds_of(data.qpos, data.qvel), corners, there

    def physics(data, action):
        data = data.replace(ctrl=action)
        return jax.lax.fori_loop(0, SUBSTEPS, lambda _, d: mjx.step(engine, d), data)

    def step(state, _, shielded: bool):
        data, under_way = state
        away = goals - data.qpos[:, :2]
        off = jnp.arctan2(away[:, 1], away[:, 0]) - data.qpos[:, 2]
        turning = jnp.clip(2 * ((off + jnp.pi) % (2 * jnp.pi) - jnp.pi), -1, 1)
        action, changed = jnp.stack([jnp.ones_like(turning), turning], 1), jnp.zeros(len(off), bool)
        if shielded:
            under_way, told = shield.step(under_way, *measured(data), action)
            action, changed = told.action, told.changed
        data = jax.vmap(physics)(data, action)
        gap = jnp.linalg.norm(hazards - data.qpos[:, None, :2], axis=-1).min(axis=1) - HAZARD
        return (data, under_way), (changed.mean(), gap)

    def drive(state, shielded: bool):
        return jax.lax.scan(lambda s, x: step(s, x, shielded), state, None, options.steps)

    data = jax.vmap(lambda _: mjx.make_data(engine))(jnp.arange(options.robots))
    under_way = jax.jit(shield.start)(*measured(data))
    print(f"certified at the start: {int(under_way.certified.sum())} of {options.robots}")
    clock = time.process_time if jax.default_backend() == "cpu" else time.perf_counter
    took = {}
    for shielded in (False, True):
        run = jax.jit(lambda state, shielded=shielded: drive(state, shielded))
        state, _ = jax.block_until_ready(run((data, under_way)))
        spent, changed, gap = [], [], np.inf
        for _ in range(options.calls):
            begin = clock()
            state, told = jax.block_until_ready(run(state))
            spent.append((clock() - begin) / options.steps)
            changed.append(float(told[0].mean()))
            gap = min(gap, float(told[1].min()))
        took[shielded] = min(spent)
        print(
            f"{'with' if shielded else 'without'} the shield: {1e3 * took[shielded]:.0f} ms a step "
            f"of {options.robots} robots ({STEP:g} s each), {100 * np.mean(changed):.1f} % of "
            f"actions changed, nearest {rounded_down(gap)} m"
        )
    print(f"on top of the simulator: {100 * (took[True] / took[False] - 1):.1f} %")


if __name__ == "__main__":
    import tyro

    with jax.enable_x64(True):
        main(tyro.cli(Options, description=__doc__))
