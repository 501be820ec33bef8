"""One file per workload: the docstring is its method, `run(bench) -> Result` measures it, `Skip`
says why not.
"""

import importlib

NAMES = (
    "control",
    "regions",
    "reference_regions",
    "bras",
    "points",
    "lps",
    "query",
    "onboard",
    "rare",
    "batch_query",
    "checking",
    "fails_safely",
    "cold_start",
    "main_job",
    "rollouts",
    "training",
    "table_one",
    "gap",
    "yield",
    "practice",
    "obstacles",
    "clutter",
    "live",
    "barn",
    "dynabarn",
    "scaling",
    "bodies",
)


def workload(name: str):
    """The module of a workload."""
    return importlib.import_module(f"benchmarks.workloads.{name}")
