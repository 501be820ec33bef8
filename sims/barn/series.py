"""Many episodes in worlds of the BARN challenge, a line each, and what came of them."""

import json
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import jax
import numpy as np
from tqdm import tqdm

import parc_jax as pj
from parc_jax.common.errors import check_count
from parc_jax.common.spelling import rounded_down, rounded_up
from sims.barn.drive import SWEEP
from sims.barn.driver import MODEL, Driver, any_world, content_of
from sims.barn.worlds import numbers, world
from sims.jackal.learn import THINKS


@dataclass(frozen=True)
class Options:
    """Which worlds, with which model."""

    worlds: tuple[int, ...] = ()
    """Numbers of worlds; default: all 200."""
    seeds: int = 1
    """Episodes in each."""
    first_seed: int = 0
    """Of the first of them, or of the key of the episodes of a law."""
    episodes: int = 0
    """So many episodes of the law instead, each in a random world, and what they show [T40]."""
    looks: tuple[int, ...] = ()
    """Numbers of these at which their claim may be read, declared before the first; default: all
    of them.
    """
    model: Path = MODEL
    """A saved model of the Jackal that thinks, `sims.barn.learn`; the one that comes along."""
    out: Path = Path("barn/drives.jsonl")
    """A line for each episode; what was driven there with all these options is not driven again. A
    folder, of episodes.
    """
    odometry: bool = False
    """The robot knows where it is by dead reckoning alone, which drifts; else it truly knows."""
    sweep: float = SWEEP
    """[s] from the first beam of its lidar to the last; 0: as the challenge's, in no time."""
    map: bool = False
    """It has the map and no lidar, and truly knows where it is."""
    prove: bool = False
    """Prove every commitment in exact arithmetic as well, after its episode."""
    save: Path | None = None
    """A folder for a file of every episode, which `parc-jax check` verifies."""
    film: Path | None = None
    """A folder for a film of every episode, a .gif, and its page, a .html."""
    clock: bool = False
    """That of the machine ends a step, as on a robot, its scan counted; else the robot waits, and a
    busy machine decides nothing.
    """
    quiet: bool = False
    """No progress bars."""
    jobs: int = field(default_factory=lambda: os.cpu_count() or 1)
    """Processes."""


def drive_worlds(options: Options) -> tuple[list[dict], str]:
    """Drive, write a line an episode; returns the lines, and what came of all in words. Raises
    InputError for options without meaning.
    """
    check_count("seeds", options.seeds, 1, "episodes in each world")
    check_count("jobs", options.jobs, 0 if options.episodes else 1, "processes")
    if options.map and options.odometry:
        raise pj.InputError(
            "map: expected a robot that truly knows where it is; on odometry it does not, and "
            "would lose its place on the map. Leave out one of the two."
        )
    options.out.parent.mkdir(parents=True, exist_ok=True)
    driver = Driver(
        options.model,
        content_of(options.model),
        odometry=options.odometry,
        known=options.map,
        sweep=options.sweep,
        clock=options.clock,
        prove=options.prove,
        save=options.save,
        film=options.film,
    )
    _ = driver.digest  # once, and other processes take it from here
    of_model = f"Model {options.model}: {pj.load(options.model).claim}."
    if options.episodes:
        key = jax.random.PRNGKey(options.first_seed)
        asked = {"folder": options.out, "workers": options.jobs, "quiet": options.quiet}
        asked["looks"] = options.looks
        done = pj.drive.drive_episodes(driver, any_world, key, options.episodes, **asked)
        told = [one.told for one in done.driven if not one.failed]
        return told, f"{summary(told, done.n)}\n{of_model}\n{done.details()}"
    lines = options.out.read_text().splitlines() if options.out.exists() else []
    ours = [one for one in map(json.loads, lines) if driver.has(one)]
    found = {(one["world"], one["seed"]): one for one in ours}
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    asked = [(w, s) for w in options.worlds or numbers() for s in seeds]
    left = [each for each in asked if each not in found]
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(options.jobs, max(1, len(left))), context) as pool:
        done = pool.map(driver.line, [world(w) for w, _ in left], [(w, s) for w, s in left])
        shown = tqdm(done, desc="episodes", total=len(left), disable=options.quiet)
        for (number, seed), driven in zip(left, shown, strict=True):
            found[number, seed] = {"seed": seed, **driven}
            with options.out.open("a") as file:
                file.write(json.dumps(found[number, seed]) + "\n")
    told = [found[each] for each in asked]
    return told, f"{summary(told, len(told))}\n{of_model}"


def summary(found: list[dict], n: int) -> str:
    """The lines that are printed. found: what is told of those of n episodes with an outcome; the
    others count as not reached, their metric as 0.
    """
    if not found:
        return f"0 of {n} episodes reached the goal without contact, {n} without an outcome."
    reached = [one for one in found if one["reached"] and not one["touched"]]
    seconds = [one["seconds"] for one in reached] or [np.nan]
    missed = [str(one["world"]) for one in found if one not in reached]
    missed += [f"those of {n - len(found)} without an outcome"] * (len(found) < n)
    cycle, plan = (np.array([one[name] for one in found]) for name in ("cycle_ms", "plan_ms"))
    return "\n".join(
        [
            f"{len(reached)} of {n} episodes reached the goal without contact, "
            + f"{n - len(found)} without an outcome, " * (len(found) < n)
            + f"{sum(one['touched'] for one in found)} touched something, "
            f"{sum(one['left'] for one in found)} left a tube, "
            f"{sum(one['drifted'] > 0 for one in found)} drifted beyond what is allowed for; "
            f"metric {sum(one['metric'] for one in found) / n:.3f} of 0.5.",
            f"Time of those that reached it: median {np.median(seconds):.1f} s, longest "
            f"{max(seconds):.1f} s. Least clearance "
            f"{rounded_down(min(one['clearance'] for one in found))} m.",
            f"A cycle, scan and guidance included, processor time: median "
            f"{np.median(cycle[:, 0]):.1f} ms, 95 % {np.median(cycle[:, 1]):.1f} ms in the middle "
            f"episode, at most {rounded_up(cycle.max(), 3)} ms; of that the loop's step, median "
            f"{np.median(plan[:, 0]):.1f} ms, at most {rounded_up(plan.max(), 3)} ms. Longer than "
            f"it thinks, {1e3 * THINKS:.0f} ms, took {sum(one['late'] for one in found)} of "
            f"{sum(one['cycles'] for one in found)}.",
            f"Not reached, worlds: {', '.join(missed) or 'none'}.",
        ]
    )
