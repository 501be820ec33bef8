"""Dynobench's scenes, a row of the table of docs/dynobench.md each: `python -m
sims.foreign.dynobench`. Learns the models first, or takes those that are there.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import tyro

import parc_jax as pj
from sims.foreign.dynobench.episode import drive_scene, loop_of
from sims.foreign.dynobench.learn import learned
from sims.foreign.dynobench.robots import ROBOTS
from sims.foreign.dynobench.scenes import SCENES, Scene, reference, scene
from sims.foreign.dynobench.single import parked_at_once, starts


@dataclass(frozen=True)
class Options:
    """Which robots and scenes."""

    robots: tuple[str, ...] = tuple(ROBOTS)
    """Of dynobench's models."""
    scenes: tuple[str, ...] = SCENES
    """Of dynobench's scenes."""
    starts: int = 100
    """Poses drawn from every scene, for which a single manoeuvre is looked for; 0 for none."""
    folder: Path = Path("dynobench")
    """Where models, episodes and rows are kept."""


def main(options: Options) -> None:
    """Print a row a scene, and keep episodes, which `parc-jax check` verifies."""
    for name in options.robots:
        model = learned(name, options.folder)
        loop = loop_of(name, model)
        for asked in (scene(name, each) for each in options.scenes):
            place = options.folder / f"{name}_{asked.name}"
            row = row_of(asked, loop, options.starts, place)
            print(json.dumps(row), flush=True)
            with (options.folder / "rows.jsonl").open("a") as file:
                file.write(json.dumps(row) + "\n")


def row_of(asked: Scene, loop: pj.drive.Loop, n: int, place: Path) -> dict:
    """What came of a scene. n: starts of single manoeuvres. place: of the episode's file."""
    stored = reference(asked.robot, asked.name)
    driven = drive_scene(asked, loop)
    if driven.commitments:
        pj.drive.save_episode(place.with_suffix(".json"), driven.commitments)
    return {
        "robot": asked.robot,
        "scene": asked.name,
        "stored_s": stored.cost,
        "stored_by": stored.planner,
        "single": parked_at_once(asked, loop, asked.start[:3]) is not None,
        "single_s": loop.model.time.t_f,
        "starts": starts(asked, loop, n)._asdict() if n else None,
        "reached": driven.reached,
        "seconds": round(driven.seconds, 1),
        "manoeuvres": len(driven.commitments),
        "clearance": float(driven.clearance),
        "inside": driven.inside,
        "left": driven.left,
        "reason": driven.reason,
    }


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
