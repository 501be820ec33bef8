"""Drive the worlds, by the loop and by a plain planner beside it: `python -m sims.dynabarn`."""

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from parc_jax.common.keys import key_of
from sims.dynabarn import driver, plain
from sims.dynabarn.worlds import KINDS, PHASES, World, numbers, world

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
    planners: tuple[str, ...] = PLANNERS
    """loop: proved manoeuvres. plain: the bar."""
    out: Path = Path("runs/dynabarn.jsonl")
    """A line for each episode; what is there is not driven again."""
    save: Path | None = None
    """A folder for a file of every episode of the loop, which `parc-jax check` verifies."""


def begun(number: int, phase: int) -> World:
    """A world from the moment of that number on."""
    return world(number, np.random.default_rng([number, phase]).uniform(0.0, PHASES))


def episode(planner: str, number: int, phase: int, save: Path | None = None) -> dict:
    """Drive one; a line about it."""
    here, key = begun(number, phase), key_of(phase)
    told = {"planner": planner, "world": number, "phase": phase, "kind": here.kind}
    if planner == "plain":
        return told | plain.drive(here, key)
    one = driver.drive(here, key, np.random.default_rng([number, phase, 1]))
    if save is not None:
        driver.save(one, save / f"world_{number}_{phase}.json")
    return told | driver.told_of(one)


def drive(options: Options) -> str:
    """Drive all that is left; returns a table in Markdown."""
    options.out.parent.mkdir(parents=True, exist_ok=True)
    if options.save is not None:
        options.save.mkdir(parents=True, exist_ok=True)
    lines = options.out.read_text().splitlines() if options.out.exists() else []
    done = {(one["planner"], one["world"], one["phase"]): one for one in map(json.loads, lines)}
    # the worlds of all kinds alternate, so that an unfinished run has some of each
    shown = sorted(options.worlds or numbers(), key=lambda number: (number % 20, number))
    asked = [
        (planner, number, phase)
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
    print(drive(tyro.cli(Options, description=__doc__)))
