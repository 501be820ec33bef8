"""The committed results: one report per platform in baseline.json, and the page made of them."""

import json
from pathlib import Path

from benchmarks.bench import ROOT
from benchmarks.report import page
from benchmarks.run import merged
from benchmarks.workloads import workload
from parc_jax.learning.runs.files import write_atomic

BASELINE = ROOT / "benchmarks" / "baseline.json"
PAGE = ROOT / "docs" / "benchmarks.md"


def load_baselines(path: Path = BASELINE) -> dict[str, dict]:
    """Reports by platform; empty when there are none yet."""
    return json.loads(path.read_text()) if path.is_file() else {}


def update(report: dict, path: Path = BASELINE, page_path: Path = PAGE) -> dict[str, dict]:
    """Accept a report: it replaces the workloads it holds on its platform. Redraws the figures and
    writes the page.
    """
    baselines, platform = load_baselines(path), report["environment"]["platform"]
    report = merged(baselines.get(platform), report)
    for entry in report["workloads"]:
        draw = getattr(workload(entry["name"]), "figure", None)
        if draw is not None and entry["data"]:
            entry["figure"] = f"pictures/benchmark_{entry['name']}_{platform}.png"
            draw(entry["data"], page_path.parent / entry["figure"])
    baselines[platform] = report
    write_atomic(path, (json.dumps(baselines, indent=1) + "\n").encode())
    write_atomic(page_path, page(baselines).encode())
    return baselines
