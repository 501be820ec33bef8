"""The command line of the benchmarks."""

import argparse
import json
import os
import sys
from pathlib import Path

from benchmarks.workloads import NAMES


def run(arguments: list[str] | None = None) -> int:
    """Parse, run, report, judge. Exit codes: 0 good, 1 a workload failed or the gate is closed, 2
    bad input.
    """
    try:
        options = _parser().parse_args(arguments)
    except SystemExit as stop:
        return int(stop.code or 0)
    if options.quick and (options.gate or options.update_baseline):
        return _refuse(
            "--quick measures something else: it can neither be gated nor become the baseline."
        )
    unknown = [name for name in options.only or () if name not in NAMES]
    if unknown:
        return _refuse(f"--only: expected names of {', '.join(NAMES)}; got {', '.join(unknown)}.")
    platform = _platform(options.device)
    if options.device not in (None, platform):
        return _refuse(
            f"--device {options.device}: JAX offers {platform} here. Install the matching jaxlib."
        )
    return _measure(options, platform)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks", description="Benchmarks of parc_jax; docs/benchmarks.md"
    )
    parser.add_argument("--quick", action="store_true", help="tiny sizes: does everything work?")
    parser.add_argument("--only", nargs="+", metavar="NAME", help=f"some of: {', '.join(NAMES)}")
    parser.add_argument(
        "--gate", action="store_true", help="fail if anything is worse than the committed baseline"
    )
    parser.add_argument(
        "--update-baseline",
        action="store_true",
        help="accept this run: baseline.json, docs page, figure",
    )
    parser.add_argument("--device", choices=("cpu", "gpu"), help="default: what JAX finds")
    parser.add_argument("--json", type=Path, metavar="PATH", help="write the report as JSON")
    return parser


def _platform(wanted: str | None) -> str:
    """The platform JAX runs on. The choice must come before JAX is first used."""
    if wanted == "cpu":
        os.environ["JAX_PLATFORMS"] = "cpu"
    import jax

    return jax.devices()[0].platform


def _measure(options, platform: str) -> int:
    from benchmarks.baseline import load_baselines, update
    from benchmarks.bench import Bench
    from benchmarks.gate import gate
    from benchmarks.report import results
    from benchmarks.run import failed, run_workloads
    from parc_jax.learning.runs.files import write_atomic

    names = [name for name in NAMES if not options.only or name in options.only]
    report = run_workloads(
        Bench(quick=options.quick, platform=platform),
        names,
        lambda line: print(line, file=sys.stderr),
    )
    print(results(report, "# Benchmark results", 2))
    if options.json is not None:
        write_atomic(options.json, json.dumps(report, indent=1).encode())
    broken = failed(report)
    closed = []
    if options.gate:
        verdict = gate(report, load_baselines().get(platform))
        closed = verdict.failures
        print(
            "\n".join(
                [
                    "",
                    "Gate: " + ("open" if verdict.open else "CLOSED"),
                    *verdict.failures,
                    *verdict.notes,
                ]
            )
        )
    if options.update_baseline:
        if broken:
            return _refuse(f"the baseline stays as it is: {'; '.join(broken)}", 1)
        update(report)
    return 1 if broken or closed else 0


def _refuse(why: str, code: int = 2) -> int:
    print(f"benchmarks: {why}", file=sys.stderr)
    return code
