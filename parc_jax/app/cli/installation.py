"""`parc-jax bench`: the benchmarks; and `parc-jax doctor`: is this installation fit to certify?"""

import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from typing import Literal

from parc_jax.common.errors import InputError

PACKAGES = "jax jaxlib flax optax mujoco mujoco-mjx brax scipy clarabel numpy"


def bench(
    *,
    quick: bool = False,
    only: tuple[str, ...] = (),
    gate: bool = False,
    update_baseline: bool = False,
    device: Literal["cpu", "gpu"] | None = None,
    json: Path | None = None,
) -> int:
    """Measure this installation; method and results are in docs/benchmarks.md. Example: parc-jax
    bench --quick

    The benchmarks are part of the source, not of the installed package: run this in a clone.

    Args:
        quick: Tiny sizes: does everything work?
        only: Some of the workloads, by name.
        gate: Fail if anything is worse than the committed baseline.
        update_baseline: Accept this run as the baseline.
        device: Where to run. Default: the one that JAX chooses.
        json: Write the report as JSON to this file.
    """
    flags = {"--quick": quick, "--gate": gate, "--update-baseline": update_baseline}
    arguments = [flag for flag, given in flags.items() if given]
    arguments += ["--only", *only] if only else []
    arguments += ["--device", device] if device else []
    arguments += ["--json", str(json)] if json else []
    paths = [str(clone()), *filter(None, [os.environ.get("PYTHONPATH")])]
    command = [sys.executable, "-m", "benchmarks", *arguments]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    return subprocess.run(command, env=environment, check=False).returncode


def clone() -> Path:
    """The clone that this is run in or from. Raises InputError elsewhere."""
    places = (Path.cwd(), Path(__file__).resolve().parents[3])
    needed = ("benchmarks/baseline.json", "parc_jax/app/cli/installation.py")
    for place in places:
        if all((place / name).is_file() for name in needed):
            return place
    raise InputError(
        "bench: expected a clone of the source, which has the folder benchmarks; there is none "
        "here. Run it in the root of a clone."
    )


def doctor() -> int:
    """Check versions and arithmetic of this installation. Example: parc-jax doctor"""
    from parc_jax.common.backend import backend
    from parc_jax.common.probes import probe_all, probe_hang, probe_options
    from parc_jax.safe_set.corridors.first import COMPILER

    for name in PACKAGES.split():
        try:
            print(f"  {name:12} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            print(f"  {name:12} missing: pip install {name}")
    options = probe_options(dict(backend().compiler) | (COMPILER or {}))
    findings = [*probe_all(), options, probe_hang()]
    for finding in findings:
        print(f"  {'ok  ' if finding.ok else 'FAIL'} {finding.name}: {finding.detail}")
    fit = all(finding.ok for finding in findings)
    print("Fit to certify." if fit else "Not fit to certify: see the lines marked FAIL.")
    return 0 if fit else 1
