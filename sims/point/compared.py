"""Our world beside the original package, each in a Python of its own, over a pipe:

    python -m sims.point.compared --python PYTHON [--ours PYTHON] [--robot Car]

PYTHON has safety-gymnasium 1.0.0, which pins MuJoCo 2.3.3. ours: the Python that runs our world, by
default this one; with the same PYTHON both have the same MuJoCo. Prints the largest difference of
places, speeds, observations, rewards and costs, and when they part.
"""

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

HERE = Path(__file__).parent


@dataclass
class Options:
    """What to compare."""

    python: Path
    """A Python that has safety-gymnasium 1.0.0."""
    ours: Path = Path(sys.executable)
    """The Python that runs our world."""
    robot: Literal["Point", "Car"] = "Point"
    level: int = 1
    seeds: int = 5
    steps: int = 1000


def rows_of(python: Path, script: Path, *arguments: str) -> tuple[str, list[np.ndarray]]:
    """The version of MuJoCo, and rows of each episode."""
    command = [str(python), "-W", "ignore", str(script), *arguments]
    done = subprocess.run(command, check=True, text=True, capture_output=True)
    lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    return lines[0]["mujoco"], [np.array(line["rows"]) for line in lines[1:]]


def parted(one: np.ndarray, other: np.ndarray, which=slice(None)) -> str:
    """What differs between rows (n, m) of both, a step each: places first, rewards and costs last.
    which (n,) bool: the steps to compare.
    """
    steps, other = np.arange(len(one))[which], other[which]
    off = np.abs(one[which] - other)
    far = steps[off.max(axis=1) > 1e-9]
    return (
        f"  largest difference {off.max():.3g} (place {off[:, :2].max():.3g} m, reward "
        f"{off[:, -2].max():.3g}, cost {off[:, -1].max():.3g}), "
        f"return {other[:, -2].sum():.1f}, cost {other[:, -1].sum():.0f}; "
        + (
            f"above 1e-9 in {len(far)} of {len(steps)} steps, the first is step {far[0]}"
            if len(far)
            else "never above 1e-9"
        )
    )


def main() -> None:
    import tyro

    options = tyro.cli(Options, description=__doc__)
    seeds = ",".join(map(str, range(options.seeds)))
    about = (seeds, str(options.steps))
    theirs, original = rows_of(
        options.python, HERE / "original.py", f"Safety{options.robot}Goal{options.level}-v0", *about
    )
    version, ours = rows_of(
        options.ours, HERE / "ours.py", options.robot, str(options.level), *about
    )
    print(f"original on MuJoCo {theirs}, ours on {version}: {len(ours)} episodes")
    for one, other in zip(original, ours, strict=True):
        print(parted(one, other))


if __name__ == "__main__":
    main()
