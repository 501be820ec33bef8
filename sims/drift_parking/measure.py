"""Measure compile time, rates and agreement of both plants: `python -m sims.drift_parking.measure
--help`.
"""

import argparse
import os
import time

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.arrays import x64
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.simulate import jitted_rollouts
from sims.drift_parking.system import system

SURE = 481  # samples up to 4.8 s; later the car creeps, chaotically in the rounding
REPEATS = 3


def main():
    """Print one table row per plant."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plants", nargs="+", default=["ode", "mjx"], choices=["ode", "mjx"])
    parser.add_argument("--batch", type=int, default=512, help="trajectories in one compiled call")
    parser.add_argument(
        "--rollouts", type=int, default=4096, help="trajectories collected with all cores"
    )
    parser.add_argument("--reference", help=".npz with k, p, theta, n_switch to compare with")
    options = parser.parse_args()
    print(
        f"{jax.devices()[0].device_kind}, {os.cpu_count()} cores, jax {jax.__version__}, load "
        f"{os.getloadavg()[0]:.1f}"
    )
    with x64():
        for name in options.plants:
            plant = system(name)
            print(f"{name}: {rate(plant, options.batch)}; {collected(plant, options.rollouts)}")
            if options.reference:
                print(f"{name}: {agreement(plant, options.reference)}")


def rate(plant, batch: int) -> str:
    """Compile time and CPU time per trajectory of jit(vmap(rollout))."""
    keys, k = jax.random.split(jax.random.PRNGKey(0), batch), _draw(plant, batch)
    started = time.perf_counter()
    compiled = jitted_rollouts(plant).lower(keys, k).compile()
    compile_time = time.perf_counter() - started
    cpu = min(_cpu_time(lambda: compiled(keys, k)) for _ in range(REPEATS))
    each = f"{1e6 * cpu / batch:.0f} us of one core per trajectory"
    return f"compile {compile_time:.1f} s; batch {batch}: {each}"


def collected(plant, n: int) -> str:
    """Rate of `collect`, compiled beforehand."""
    wall = []
    for _ in range(1 + REPEATS):
        started = time.perf_counter()
        collect(plant, jax.random.PRNGKey(1), n, quiet=True)
        wall.append(time.perf_counter() - started)
    return f"collect({n}): {n / min(wall[1:]):.0f} trajectories/s"


def agreement(plant, path: str) -> str:
    """Largest differences from a file of reference runs."""
    with np.load(path) as data:
        want_pose = np.concatenate([data["p"], data["theta"][..., None]], axis=-1)
        run = jax.jit(plant.run)(jnp.asarray(data["k"].T))
        same = int((np.asarray(run.switch) == data["n_switch"]).sum())
    pose = np.stack([np.asarray(field).T for field in run.states[:3]], axis=-1)
    error = np.abs(pose - want_pose)
    return (
        f"{same} of {len(error)} switch at the same sample; to 4.8 s "
        f"{error[:, :SURE, :2].max():.1e} m "
        f"{error[:, :SURE, 2].max():.1e} rad; to 7.8 s {error[..., :2].max():.3f} m "
        f"{error[..., 2].max():.3f} rad"
    )


def _draw(plant, n):
    return jnp.asarray(np.random.default_rng(0).uniform(plant.domain.lo, plant.domain.hi, (n, 2)))


def _cpu_time(call) -> float:
    started = time.process_time()
    jax.block_until_ready(call())
    return time.process_time() - started


if __name__ == "__main__":
    main()
