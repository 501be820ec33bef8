"""How well a policy arrives and hovers: `python -m sims.asv.evaluate` prints the table and can
write it as JSON.
"""

import functools
import json
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from sims.asv.control import run
from sims.asv.disturbance import LAWS
from sims.asv.plant import make_plant
from sims.asv.policy import HOVER, Policy, load_policy
from sims.asv.scenario import DOMAIN
from sims.asv.vessel import SYSID

ARRIVED = 0.3  # [m] from the goal


@functools.partial(jax.jit, static_argnames=("law", "plant", "n_control"))
def _distances(policy: Policy, keys, ks, law: str, plant: str, n_control: int):
    """Offsets p - goal (B, n_control + 1, 2) [m], one sample per control period."""
    step = make_plant(plant, SYSID)

    def one(key, k):
        hull = run(SYSID, step, LAWS[law], policy, key, k[:2], k[2], n_control, policy.n_physics)
        return hull[:, :2] - k[None, :2]

    return jax.vmap(one)(keys, ks)


def hover_statistics(offsets: np.ndarray, period: float) -> dict:
    """Arrival and hovering of offsets from the goal (B, n + 1, 2) [m], sampled every `period` [s].

    arrival: first time within ARRIVED; never counts as infinite. spread: standard deviation over
    the rollouts, larger axis, of the offset at 10 s and at the end. error: distance to the goal.
    """
    distance = np.hypot(offsets[..., 0], offsets[..., 1])
    inside = distance <= ARRIVED
    arrival = np.where(inside.any(axis=1), inside.argmax(axis=1) * period, np.inf)
    at_10_s = round(10.0 / period)
    return {
        "rollouts": len(offsets),
        "horizon_s": round(period * (offsets.shape[1] - 1), 9),
        "arrived_share": float(np.isfinite(arrival).mean()),
        "arrival_median_s": float(np.median(arrival)),
        "arrival_95_percent_s": float(np.quantile(arrival, 0.95, method="higher")),
        "spread_10_s_m": float(offsets[:, at_10_s].std(axis=0).max()),
        "spread_end_m": float(offsets[:, -1].std(axis=0).max()),
        "mean_offset_end_m": float(np.abs(offsets[:, -1].mean(axis=0)).max()),
        "error_end_median_m": float(np.median(distance[:, -1])),
        "error_end_99_percent_m": float(np.quantile(distance[:, -1], 0.99)),
    }


def evaluate(
    policy: Policy,
    law: str,
    key: jax.Array,
    n: int = 2000,
    seconds: float = 20.0,
    plant: str = "ode",
) -> dict:
    """`hover_statistics` of n rollouts over the study's K (goals 4 ... 7 m ahead) under the named
    law.
    """
    draw_key, run_key = jax.random.split(key)
    dtype = jnp.result_type(float)
    lo, hi = jnp.asarray(DOMAIN.lo, dtype)[None], jnp.asarray(DOMAIN.hi, dtype)[None]
    ks = lo + (hi - lo) * jax.random.uniform(draw_key, (n, 3), dtype)
    offsets = _distances(
        policy, jax.random.split(run_key, n), ks, law, plant, round(seconds / policy.period)
    )
    return hover_statistics(np.asarray(offsets), policy.period)


@dataclass
class Options:
    """What to evaluate."""

    policy: Path = HOVER  # policy file
    layout: str | None = None  # how a published file observes: capture or neuralparc
    rollouts: int = 2000  # per law
    seconds: float = 20.0  # length of a rollout
    seed: int = 0
    out: Path | None = None  # JSON file to write


def main(argv: list[str] | None = None) -> None:
    """Command line."""
    import tyro

    options = tyro.cli(
        Options, args=argv, prog="python -m sims.asv.evaluate", description="Arrival and hovering."
    )
    policy = load_policy(options.policy, options.layout)
    key = jax.random.key(options.seed)
    table = {law: evaluate(policy, law, key, options.rollouts, options.seconds) for law in LAWS}
    width = max(map(len, table["none"]))
    print(f"{'':{width}s}" + "".join(f"{law:>12s}" for law in table))
    for row in table["none"]:
        print(f"{row:{width}s}" + "".join(f"{result[row]:12.4g}" for result in table.values()))
    if options.out:
        options.out.write_text(json.dumps({"seed": options.seed, "laws": table}, indent=1) + "\n")


if __name__ == "__main__":
    main()
