"""`parc-jax bench`: the benchmark suite."""

from pathlib import Path
from typing import Literal


def bench(
    *,
    quick: bool = False,
    only: tuple[str, ...] = (),
    gate: bool = False,
    update_baseline: bool = False,
    device: Literal["cpu", "gpu"] | None = None,
    json: Path | None = None,
) -> int:
    """Measure this installation; method and results are in docs/benchmarks.md. Example: parc-jax bench --quick

    Args:
        quick: Tiny sizes: does everything work?
        only: Some of the workloads, by name.
        gate: Fail if anything is worse than the committed baseline.
        update_baseline: Accept this run as the baseline.
        device: Where to run. Default: what JAX finds.
        json: Write the report as JSON to this file.
    """
    from benchmarks import main

    flags = {"--quick": quick, "--gate": gate, "--update-baseline": update_baseline}
    arguments = [flag for flag, given in flags.items() if given]
    arguments += ["--only", *only] if only else []
    arguments += ["--device", device] if device else []
    return main([*arguments, *(["--json", str(json)] if json else [])])
