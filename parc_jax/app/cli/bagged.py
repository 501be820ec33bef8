"""Options of `learn` for bags."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from parc_jax.common.errors import InputError
from parc_jax.common.options import Options
from parc_jax.common.sets.box import Box
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.learning.system import TimeGrid


@dataclass(frozen=True)
class Bagged(Options):
    """How runs are cut out of bags."""

    pose: str | None = None
    """Bags only: topic of poses, such as /odom, or /tf with --frames."""
    command: str | None = None
    """Bags only: topic of commands; each new one begins a run."""
    k: tuple[str, ...] | None = None
    """Bags only: the numbers of a command that are k, such as linear.x angular.z."""
    given: tuple[str, ...] | None = None
    """Bags only: numbers in the messages of poses that are measured when a run begins, such as
    twist.twist.linear.x; they are the first parameters. Default: none."""
    frames: tuple[str, str] | None = None
    """Bags only: parent and child of the transform that is meant, or that poses must have."""
    footprint: str | None = None
    """Bags only: the outline of the robot as Nav2 spells it, whose corners are its points.
    Default: one point."""
    after: float = 0.0
    """Bags only: seconds from a command to where its run begins."""
    short: Literal["failed", "dropped"] = "failed"
    """Bags only: what a run is that the next command cut short: failed, or dropped, which changes
    the law of the runs."""
    bridge: float | None = None
    """Bags only: seconds between poses that may be bridged. Default: two record steps."""
    clock: Literal["header", "recorder"] = "header"
    """Bags only: the stamps of messages, or when they were recorded."""


def are_bags(path: Path) -> bool:
    """Is there a bag, or a folder with one and without a table of k?"""
    from parc_jax.ros.bags.recording import is_bag

    if is_bag(path) or not path.is_dir():
        return is_bag(path)
    return not (path / "k.csv").exists() and any(map(is_bag, path.iterdir()))


def from_bags(
    path: Path, time: TimeGrid | None, domain: Box | None, k_law: str, asked: Bagged
) -> RolloutBatch:
    """Runs from bags. Raises InputError."""
    from parc_jax.problem.world.outlines import read_footprint
    from parc_jax.ros.bags.load import load_bags

    needed = {"dt and --t-f": time, "pose": asked.pose, "command": asked.command, "k": asked.k}
    for name, value in needed.items():
        if value is None:
            raise InputError(f"{path}: expected --{name} to cut runs out of bags; none was given.")
    options = vars(asked) | {"given": asked.given or ()}
    outline = options.pop("footprint")
    robot = None if outline is None else read_footprint(outline)
    return load_bags(path, time, robot=robot, domain=domain, k_law=k_law, **options)
