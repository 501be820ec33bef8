"""Control steps per second of both plants, rollouts of the scenario in a batch: `python -m
sims.asv.speed`.
"""

import time
from dataclasses import dataclass

import jax
import jax.numpy as jnp

from sims.asv.scenario import system


def control_steps_per_second(
    plant: str, law: str, batch: int, repeats: int = 5
) -> tuple[float, float]:
    """(best rate of `repeats` runs over all local devices, seconds to compile). Blocks on the
    result.
    """
    box = system(plant, law)
    mesh = jax.make_mesh(
        (jax.device_count(),), ("batch",), axis_types=(jax.sharding.AxisType.Auto,)
    )
    rows = jax.sharding.NamedSharding(mesh, jax.sharding.PartitionSpec("batch"))
    draw_key, run_key = jax.random.split(jax.random.key(0))
    dtype = jnp.result_type(float)
    lo, hi = jnp.asarray(box.domain.lo, dtype)[None], jnp.asarray(box.domain.hi, dtype)[None]
    ks = jax.device_put(lo + (hi - lo) * jax.random.uniform(draw_key, (batch, 3), dtype), rows)
    keys = jax.device_put(jax.random.split(run_key, batch), rows)
    start = time.perf_counter()
    rollouts = jax.jit(jax.vmap(box.rollout)).lower(keys, ks).compile()
    compiling = time.perf_counter() - start
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        jax.block_until_ready(rollouts(keys, ks))
        seconds.append(time.perf_counter() - start)
    return batch * box.control_steps / min(seconds), compiling


@dataclass
class Options:
    """What to time."""

    batch: int = 2048  # rollouts at once, a multiple of the cores
    cores: int = 1  # virtual devices; a batched scan runs on one thread of each
    law: str = "study"
    float32: bool = False  # default is float64, as the engine calls it


def main(argv: list[str] | None = None) -> None:
    """Command line."""
    import tyro

    options = tyro.cli(Options, args=argv, prog="python -m sims.asv.speed")
    jax.config.update("jax_num_cpu_devices", options.cores)
    jax.config.update("jax_enable_x64", not options.float32)
    for plant in ("ode", "mjx"):
        rate, compiling = control_steps_per_second(plant, options.law, options.batch)
        print(
            f"{plant}: {rate:12,.0f} control steps/s, {10 * rate:12,.0f} physics steps/s, compiled "
            f"in {compiling:.1f} s"
        )


if __name__ == "__main__":
    main()
