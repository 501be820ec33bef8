"""Are promises broken as rarely as they say? `python -m benchmarks.attacks coverage`.

Each kind of claim is made thousands of times by the real pipeline on a robot whose errors are known
exactly and that jumps for every k of a thin slab. A promise is broken when a new run leaves the
tube with more than the promised probability. It may happen in a share delta of the repetitions.
"""

import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import jax
import tyro
from scipy.stats import beta

from benchmarks.attacks.promises import DELTA, EPS, PROMISES, Promise

# Share of K in which the robot jumps. Rare: a true claim may miss it. Worst: just above eps, so
# that the claim is false whenever the holdout misses the slab.
SLABS = {"rare": EPS / 5, "worst": EPS * 1.02}
UNCERTAINTY = 1e-3  # probability that the interval of one row misses


@dataclass(frozen=True)
class Options:
    """How often, and what."""

    repeats: int = 2000
    """Repetitions of every promise on every slab."""
    only: tuple[str, ...] = ()
    """Some of the promises; default: all."""
    slabs: tuple[str, ...] = ()
    """"rare" or "worst"; default: both."""
    seed: int = 13
    """Seed of the campaign."""
    json: Path | None = None
    """Write the rows here."""


def interval(count: int, n: int, uncertainty: float = UNCERTAINTY) -> tuple[float, float]:
    """Clopper-Pearson interval of a frequency, two-sided."""
    low = 0.0 if count == 0 else float(beta.ppf(uncertainty / 2, count, n - count + 1))
    high = 1.0 if count == n else float(beta.isf(uncertainty / 2, count + 1, n - count))
    return low, high


def repeat(promise: Promise, width: float, repeats: int, seed: int) -> dict:
    """One row: how often the promise was broken, between what bounds, and the mean probability."""
    keys = jax.random.split(jax.random.PRNGKey(seed), repeats)
    begin = time.perf_counter()
    broken, total = 0, 0.0
    for key in keys:
        promised, real = promise.once(width, key)
        broken += int(real > promised)
        total += real
    low, high = interval(broken, repeats)
    return {
        "promise": promise.name,
        "slab": width,
        "repeats": repeats,
        "broken": broken,
        "frequency": broken / repeats,
        "low": low,
        "high": high,
        "allowed": promise.allowed,
        "mean": total / repeats,
        "control": promise.control,
        "seconds": time.perf_counter() - begin,
    }


def refuted(row: dict) -> bool:
    """True when the repetitions show that the promise is broken more often than allowed."""
    return row["low"] > row["allowed"]


def line(row: dict) -> str:
    """One row of the Markdown table."""
    verdict = "BROKEN TOO OFTEN" if refuted(row) else "keeps its word"
    if row["control"]:
        verdict = "seen to be false" if refuted(row) else "not seen to be false"
    return (
        f"| {row['promise']} | {row['slab']:g} | {row['broken']} of {row['repeats']:,} "
        f"| {row['frequency']:.4f} [{row['low']:.4f}, {row['high']:.4f}] | {row['allowed']:g} "
        f"| {row['mean']:.4f} | {verdict} |"
    )


def run(options: Options) -> int:
    """Print the table. Exit code 1 when a promise is broken too often, or no slab shows that a
    control is false.
    """
    jax.config.update("jax_enable_x64", True)
    print(
        f"eps = {EPS:g}, delta = {DELTA:g}; intervals at {1 - UNCERTAINTY:.4g}; seed {options.seed}"
    )
    print("| promise | slab | broken | frequency | allowed | mean probability | verdict |")
    print("| --- | --- | --- | --- | --- | --- | --- |", flush=True)
    rows = []
    for promise in PROMISES:
        if options.only and promise.name not in options.only:
            continue
        for name, width in SLABS.items():
            if options.slabs and name not in options.slabs:
                continue
            rows.append(repeat(promise, width, options.repeats, options.seed))
            print(line(rows[-1]), flush=True)
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1))
    false = [row["promise"] for row in rows if refuted(row) and not row["control"]]
    controls = {row["promise"] for row in rows if row["control"]}
    blind = controls - {row["promise"] for row in rows if refuted(row)}
    for name in false:
        print(f"{name}: broken more often than allowed", file=sys.stderr)
    for name in sorted(blind):
        print(f"{name}: a false claim that the campaign did not see", file=sys.stderr)
    return 1 if false or blind else 0


def main(arguments: list[str]) -> int:
    """The command."""
    return run(tyro.cli(Options, args=arguments, description=__doc__))
