"""What the shield costs on top of MJX's own step, for a batch of Points in one jitted call:

    python -m sims.point.in_mjx [--around]

Full thrust towards a goal among the hazards of as many worlds of level 1 (no vases), or a driver
that goes around them at a moderate speed and stops at the goal. Prints the
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

MODERATE = 0.4  # [m/s]
NEAR = 0.7, 0.4  # [m] from a hazard's middle where a driver begins to turn, and where it turns most


@dataclass(frozen=True)
class Options:
    """How many."""

    robots: int = 1024
    steps: int = 20
    """Of the environment, in one call."""
    before: int = 2
    """Calls that are not measured: at first nobody is near a hazard."""
    calls: int = 3
    around: bool = False
    """Go around hazards, at most at MODERATE, and stop at the goal; else full thrust at it."""


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

    def policy(data):
        away = goals - data.qpos[:, :2]
        far = jnp.linalg.norm(away, axis=1, keepdims=True)
        if options.around:
            off = data.qpos[:, None, :2] - hazards
            apart = jnp.linalg.norm(off, axis=-1, keepdims=True)
            aside = jnp.stack([-off[..., 1], off[..., 0]], -1)
            aside *= jnp.sign((aside * away[:, None]).sum(axis=-1, keepdims=True))
            near = jnp.clip((NEAR[0] - apart) / (NEAR[0] - NEAR[1]), 0, 2)
            away = away / jnp.maximum(far, 0.3) + (near * (off + aside) / apart).sum(axis=1)
        off = jnp.arctan2(away[:, 1], away[:, 0]) - data.qpos[:, 2]
        off = (off + jnp.pi) % (2 * jnp.pi) - jnp.pi
        thrust = jnp.ones_like(off)
        if options.around:
            speed = MODERATE * jnp.clip(jnp.cos(off), 0, 1) * jnp.minimum(far[:, 0], 1)
            thrust = speed - speeds_of(data.qpos, data.qvel)[:, 0]
        return jnp.stack([jnp.clip(thrust, -1, 1), jnp.clip(2 * off, -1, 1)], axis=1)

    def step(state, _, shielded: bool):
        data, under_way = state
        action, changed = policy(data), jnp.zeros(options.robots, bool)
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
        state, gap = (data, under_way), np.inf
        for _ in range(options.before):
            state, told = jax.block_until_ready(run(state))
            gap = min(gap, float(told[1].min()))
        spent = []
        for _ in range(options.calls):  # each of the same steps, of which the least counts
            begin = clock()
            _, told = jax.block_until_ready(run(state))
            spent.append((clock() - begin) / options.steps)
        changed, gap = told[0].mean(), min(gap, float(told[1].min()))
        took[shielded] = min(spent)
        print(
            f"{'with' if shielded else 'without'} the shield: {1e3 * took[shielded]:.0f} ms a step "
            f"of {options.robots} robots ({STEP:g} s each), {100 * changed:.1f} % of "
            f"actions changed, nearest {rounded_down(gap)} m"
        )
    print(f"on top of the simulator: {100 * (took[True] / took[False] - 1):.1f} %")


if __name__ == "__main__":
    import tyro

    with jax.enable_x64(True):
        main(tyro.cli(Options, description=__doc__))
