"""What a million scenes, or a million runs, cost on a fleet of machines: `python -m
benchmarks.fleet` prints the table of docs/devices.md. On paper: rates and times to start are the
committed ones of one machine; power and price are assumed.
"""

from typing import NamedTuple

from benchmarks.baseline import load_baselines
from parc_jax.common.spelling import counted

MACHINES = (1, 10, 1000)
ITEMS = 1_000_000
# Assumed. A server processor of 64 cores takes some 280 W, so 4.4 W a core; as much again for
# memory, fans and conversion.
POWER = 10.0  # [W] per processor
PRICE = 0.04  # [USD] per processor and hour, about what clouds ask for one
WORK = {
    "scenes, each to its first certified plan": ("batch_query.4096.rate", "batch_query.64.compile"),
    **{
        f"runs of {name}, {plant}": (f"{key}.rate", f"{key}.compile")
        for system, name in (("drift_parking", "drift parking"), ("asv", "the boat"))
        for plant in ("ode", "mjx")
        for key in (f"rollouts.{system}.{plant}.256",)
    },
}


class Cost(NamedTuple):
    """Of all items on a fleet."""

    seconds: float
    watt_hours: float
    dollars: float


def cost(n: float, machines: int, rate: float, start: float, processors: int) -> Cost:
    """n items on machines that each take `start` [s] to begin and then do `rate` [1/s] on all of
    their processors. All of these count as busy from the beginning, so what is spent is an upper
    bound while a machine starts.
    """
    hours = processors * (machines * start + n / rate) / 3600
    return Cost(start + n / rate / machines, hours * POWER, hours * PRICE)


def table(report: dict) -> list[str]:
    """Rows of Markdown from a report of the benchmarks."""
    known = {m["key"]: m["value"] for w in report["workloads"] for m in w["metrics"]}
    processors, begin = report["environment"]["processors"], known["cold_start.empty_cache.median"]
    rows = [
        f"| a million | {' | '.join(counted(m, 'machine') for m in MACHINES)} |",
        "|---" * (1 + len(MACHINES)) + "|",
    ]
    for name, (rate, compiling) in WORK.items():
        each = [
            cost(ITEMS, machines, known[rate], begin + known[compiling], processors)
            for machines in MACHINES
        ]
        cells = (f"{c.seconds:,.0f} s, {c.watt_hours:.2g} Wh, {c.dollars:.2g} $" for c in each)
        rows.append(f"| {name} | {' | '.join(cells)} |")
    return rows


if __name__ == "__main__":
    print("\n".join(table(load_baselines()["cpu"])))
