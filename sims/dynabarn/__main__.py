"""Drive the worlds, by the loop and by a plain planner beside it: `python -m sims.dynabarn`."""

import json
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

import parc_jax as pj
from parc_jax.app.cli.places import require_place
from parc_jax.common.keys import key_of
from parc_jax.learning.systems.content import whole_digest
from sims.dynabarn import driver, movers, plain, robot
from sims.dynabarn.sight import Known, Seen
from sims.dynabarn.worlds import FILE, KINDS, PHASES, Law, World, numbers, world
from sims.ended import ended

PLANNERS = ("loop", "plain")


@dataclass(frozen=True)
class Options:
    """Which worlds, and who drives."""

    worlds: tuple[int, ...] = ()
    """Numbers of worlds; default: all 40."""
    phases: int = 1
    """Moments of each at which an episode begins, drawn by number."""
    first_phase: int = 0
    """Number of the first of them."""
    lidar: bool = False
    """Movers are seen by the lidar; else their places are known."""
    planners: tuple[str, ...] = PLANNERS
    """loop: proved manoeuvres. plain: the bar."""
    out: Path = Path("runs/dynabarn.jsonl")
    """A line for each episode; what was driven there with all these options is not driven again. A
    folder, of episodes.
    """
    episodes: int = 0
    """So many episodes of the loop in fresh worlds of the law instead, and what they show [T40]."""
    kinds: tuple[str, ...] = tuple(KINDS)
    """Kinds of these."""
    save: Path | None = None
    """A folder for a file of every episode of the loop, which `parc-jax check` verifies."""


def begun(number: int, phase: int) -> World:
    """A world from the moment of that number on."""
    return world(number, np.random.default_rng([number, phase]).uniform(0.0, PHASES))


def episode(
    planner: str,
    number: int,
    phase: int,
    lidar: bool = False,
    save: Path | None = None,
) -> dict:
    """Drive one; a line about it."""
    here, key = begun(number, phase), key_of(phase)
    told = {"planner": planner, "world": number, "phase": phase, "lidar": lidar}
    told |= {"kind": here.kind, "driver": digest_of(planner, lidar)}
    sight = (Seen if lidar else Known)(here, np.random.default_rng([number, phase, 1]))
    if planner == "plain":
        return told | plain.drive(here, key, sight)
    one = driver.drive(here, key, sight)
    told |= driver.told_of(one)
    if save is not None and told["claimed"]:
        driver.save(one, file_of(told, save))
    return told


def digest_of(planner: str, lidar: bool) -> str:
    """Of all that decides its episodes: code, model, networks and worlds."""
    files = [file.read_bytes() for file in (robot.MODEL, movers.NETWORKS, FILE)]
    return whole_digest([episode, planner, lidar, files])[:16]


def file_of(one: dict, save: Path) -> Path:
    """Of the episode of a line."""
    return save / f"world_{one['world']}_{one['phase']}_{one['driver'][:8]}.json"


@dataclass(frozen=True)
class Driver:
    """Drives a fresh world with the randomness of a seed, (2,) words; returns an `Outcome`.

    Its commitments are not told: each is about who was known, for a part of its time, and a contact
    with others or later is none of its tubes. content: as of `digest_of`: a folder of episodes
    goes on with the same model, networks and worlds alone.
    """

    lidar: bool
    content: str

    def __call__(self, world: World, seed) -> pj.drive.Outcome:
        sight = (Seen if self.lidar else Known)(world, np.random.default_rng(seed))
        one = driver.drive(world, np.asarray(seed, np.uint32), sight)
        told = {"planner": "loop", "world": world.number, "kind": world.kind}
        return pj.drive.Outcome(one.touched, one.left, told | driver.told_of(one))


def count(options: Options) -> str:
    """Drive fresh worlds; returns a table and what is said of the law."""
    done = pj.drive.drive_episodes(
        Driver(options.lidar, digest_of("loop", options.lidar)),
        Law(options.kinds),
        key_of(0),
        options.episodes,
        folder=options.out,
        workers=0,
    )
    told = [one.told for one in done.driven if not one.failed]
    said = f"{sum(one['reached'] for one in told)} of {done.n} reached the goal"
    if done.failed:
        said += f", {done.failed} without an outcome, which the table leaves out"
    return f"{said}.\n\n{table(told)}\n{done.details()}"


def drive(options: Options) -> str:
    """Drive all that is left; returns a table in Markdown."""
    if options.episodes:
        return count(options)
    require_place(options.out)
    require_place(options.save, folder=True)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    if options.save is not None:
        options.save.mkdir(parents=True, exist_ok=True)
    lines = options.out.read_text().splitlines() if options.out.exists() else []
    digests = [digest_of(planner, options.lidar) for planner in options.planners]
    done = {
        (one["planner"], one["world"], one["phase"], one["lidar"]): one
        for one in map(json.loads, lines)
        if one.get("driver") in digests
        and (not (options.save and one.get("claimed")) or file_of(one, options.save).exists())
    }
    # the worlds of all kinds alternate, so that an unfinished run has some of each
    shown = sorted(options.worlds or numbers(), key=lambda number: (number % 20, number))
    asked = [
        (planner, number, phase, options.lidar)
        for phase in range(options.first_phase, options.first_phase + options.phases)
        for number in shown
        for planner in options.planners
    ]
    for each in asked:
        if each not in done:
            done[each] = episode(*each, options.save)
            with options.out.open("a") as file:
                file.write(json.dumps(done[each]) + "\n")
    return table([done[each] for each in asked])


def table(told: list[dict]) -> str:
    """A row for each planner and kind."""
    rows = [
        "| planner | worlds | reached | hit | why | seconds, median and most |",
        "|" + "---|" * 6,
    ]
    for planner in PLANNERS:
        for kind in KINDS:
            ours = [one for one in told if one["planner"] == planner and one["kind"] == kind]
            if not ours:
                continue
            well = [one["seconds"] for one in ours if one["reached"]] or [np.nan]
            why = Counter(one["cause"] for one in ours if one["cause"])
            causes = "; ".join(f"{n} {cause}" for cause, n in why.most_common())
            rows.append(
                f"| {planner} | {kind} | {sum(one['reached'] for one in ours)} of {len(ours)} | "
                f"{sum(one['clearance'] <= 0 for one in ours)} | {causes} | "
                f"{np.median(well):.1f}, {max(well):.1f} |"
            )
    return "\n".join(rows)


if __name__ == "__main__":
    options = tyro.cli(Options, description=__doc__)
    sys.exit(ended("sims.dynabarn", lambda: drive(options)))
