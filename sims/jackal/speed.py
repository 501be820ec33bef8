"""Physics steps per second of three ways to run many robots: `python -m sims.jackal.speed`.

`batch` is `mujoco.batch.Batch`, which this robot uses: its robots may differ in friction and mass;
`rollout` is `mujoco.rollout`, the same engine; `mjx` is MuJoCo in JAX.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import jax
import numpy as np

from sims.jackal import params as c
from sims.jackal.floor import LAWS, draw
from sims.jackal.robots import Robots, model, wheel_speeds
from sims.quiet import lenient, quiet_import

COMMAND = np.array([1.5, 1.0])


def by_batch(n: int, ticks: int, threads: int) -> Callable:
    """Robots of this folder."""
    keys = np.random.default_rng(0).integers(2**32, size=(n, 2), dtype=np.uint32)
    law = LAWS["floor"]
    robots = Robots(law, draw(law, keys), np.zeros((n, 3)), threads)
    return lambda: robots.drive(np.tile(COMMAND, (ticks, n, 1)), c.RAMP)


def by_rollout(n: int, ticks: int, threads: int) -> Callable:
    """The engine's own rollouts, alike robots."""
    import mujoco
    from mujoco import rollout

    m = model()
    data = [mujoco.MjData(m) for _ in range(threads)]
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.zeros((n, mujoco.mj_stateSize(m, kind)))
    mujoco.mj_getState(m, data[0], state[0], kind)
    state[:] = state[0]
    ctrl = np.tile(wheel_speeds(COMMAND), (n, ticks * c.SUBSTEPS, 1))
    engine = rollout.Rollout(nthread=threads)
    return lambda: engine.rollout(m, data, state, ctrl)


def by_mjx(n: int, ticks: int, threads: int) -> Callable:
    """A scan of MJX steps in float64; threads are XLA's."""
    mjx = quiet_import("mujoco.mjx")
    with lenient():
        put = mjx.put_model(model())
        start = mjx.make_data(model()).replace(ctrl=jax.numpy.asarray(wheel_speeds(COMMAND)))

        def run(height):
            data = start.replace(qpos=start.qpos.at[2].add(height))
            steps = ticks * c.SUBSTEPS
            return jax.lax.scan(lambda d, _: (mjx.step(put, d), None), data, length=steps)[0].qpos

        heights = jax.numpy.linspace(0.0, 1e-4, n)
        compiled = jax.jit(jax.vmap(run)).lower(heights).compile()
    return lambda: jax.block_until_ready(compiled(heights))


@dataclass
class Options:
    """What to time."""

    robots: int = 100
    ticks: int = 50
    threads: int = 2


def main(argv: list[str] | None = None) -> None:
    """Command line."""
    import tyro

    options = tyro.cli(Options, args=argv, prog="python -m sims.jackal.speed")
    jax.config.update("jax_enable_x64", True)
    for way in (by_batch, by_rollout, by_mjx):
        made = time.process_time()
        run = way(options.robots, options.ticks, options.threads)
        wall, processor = time.perf_counter(), time.process_time()
        run()
        steps = options.robots * options.ticks * c.SUBSTEPS
        print(
            f"{way.__name__[3:]:8} {steps / (time.perf_counter() - wall):9,.0f} steps/s, "
            f"{steps / (time.process_time() - processor):9,.0f} per second of a processor, "
            f"{processor - made:.1f} s to make"
        )


if __name__ == "__main__":
    main()
