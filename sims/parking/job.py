"""`parc-jax run parking --case 8`: park with the model that comes along; episode, picture, film."""

import json as as_json
import time
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj
from parc_jax.common.spelling import rounded_up
from parc_jax.drive.loop.episode_file import load_episode
from sims.parking.car import ROLLS_ON, SHARES
from sims.parking.cases import FILE, GOAL, case, numbers
from sims.parking.drive import Parked, drive
from sims.parking.film import draw, sheet
from sims.parking.predict import MODEL
from sims.parking.prove import loop_of

SHIPPED = {1: 10.8, 2: 14.4, 4: 38.3, 5: 8.9}  # [s] of a public planner; 4 and 5 touch
CLOCK = (
    f"what is told in s is progress, no time: 1 to turn the wheels, {SHARES} for equal shares of "
    "the way, 1 to brake; nothing is said between records, four of them in each of these; a "
    f"manoeuvre left after {ROLLS_ON} of them is left while the car rolls, and what is measured "
    "then is known at once"
)
MOST_TURNED = 90  # [degrees] that a goal may leave to the heading
HEAD = (
    "| case | parked | nearest | gears | driven | shipped | planned | links | rolled | file "
    "| check |\n|---|---|---|---|---|---|---|---|---|---|---|"
)


@dataclass(frozen=True)
class Options:
    """Which cases, with which model."""

    case: tuple[int, ...] = ()
    """Numbers of cases."""
    all: bool = False
    """All of the file."""
    file: Path = FILE
    """A file of cases: number, and of each start, goal: x, y [m], heading [rad] of the rear axle,
    and obstacles: polygons, lists of corners [x, y] in m."""
    model: Path = MODEL
    out: Path = Path("runs/parking")
    """A folder for episodes and pictures."""
    film: bool = False
    """A film of each, beside its picture."""
    start: float = 0.0
    """Metres by which poses are measured wrongly, and known to be, along each axis."""
    heading: float = 0.0
    """Radians, likewise."""
    within: tuple[float, float] = (GOAL[0], float(np.degrees(GOAL[1])))
    """Metres along and across, and degrees: how far from the goal the car may rest."""
    seed: int = 0


def job(
    *,
    case: tuple[int, ...] = (8,),
    out: Path = Options.out,
    model: Path = MODEL,
    seed: int = 0,
    figures: bool = True,
    quiet: bool = False,
    json: bool = False,
) -> int:
    """Park cases that come along. Returns 0 when all are parked, as proved, nothing was touched
    and no tube left, else 1. Raises InputError.
    """
    options = Options(case=case, model=model, out=out, film=figures, seed=seed)
    done = park_all(options, say=(lambda *_: None) if quiet or json else print)
    if json:
        print((out / "cases.json").read_text())
    return int(not good(done))


def park(number: int, options: Options) -> tuple[Parked, str]:
    """Drive a case, save and check its episode; returns a row of the table too."""
    known = case(number, options.file)
    loop = loop_of(options.model, options.start, options.heading)
    within = options.within[0], float(np.radians(options.within[1]))
    one = drive(known, loop, jax.random.PRNGKey(options.seed + number), within=within)
    size, checked, place = "", "", options.out / f"case_{number}.json"
    for kind in (".json", ".png", ".gif"):  # of an older drive
        place.with_suffix(kind).unlink(missing_ok=True)
    if one.commitments:
        place.parent.mkdir(parents=True, exist_ok=True)
        told = {"seconds": one.seconds, "parked": one.reached, "why": one.why}
        told |= {"within": options.within, "clock": "of progress: none passes while it plans"}
        pj.drive.save_episode(place, one.commitments, told, assumed={"clock": CLOCK})
        begin = time.process_time()
        load_episode(place)
        checked = f"{time.process_time() - begin:.1f} s"
        size = f"{place.stat().st_size / 1e6:.1f} MB"
        draw(place.with_suffix(".png"), known, one)
        if options.film:
            draw(place.with_suffix(".gif"), known, one, film=True)
    parked = "yes" if one.reached and one.proved else f"no: {one.why:.60}"
    shipped = f"{SHIPPED[number]:.1f} s" if number in SHIPPED and options.file == FILE else ""
    cells = [
        number,
        parked + (", left a tube" if one.left else ""),
        f"{np.floor(100 * one.clearance):.0f} cm",
        one.gears,
        f"{one.seconds:.1f} s",
        shipped,
        f"{one.planned:.1f} s",
        len(one.commitments),
        one.rolled,
        size,
        checked,
    ]
    return one, "| " + " | ".join(map(str, cells)) + " |"


def park_all(options: Options, say=print) -> list[Parked]:
    """Park the cases of the options, and write what came of them. say: prints. Raises InputError
    where there are none, or where one of them is broken.
    """
    listed = numbers(options.file) if options.all else options.case
    if not listed:
        raise pj.InputError("parking: expected --all, or --case with numbers of cases.")
    if not (0 < options.within[0] < np.inf and 0 < options.within[1] < MOST_TURNED):
        raise pj.InputError(
            f"within: expected metres and degrees above 0, fewer than {MOST_TURNED}; got "
            f"{options.within}."
        )
    for number in listed:  # before the long part
        case(number, options.file)
    say(HEAD)
    done = []
    for number in listed:
        one, row = park(number, options)
        say(row)
        done.append(one)
    parked = sum(one.reached and one.proved for one in done)
    touched, left = (sum(getattr(one, name) for one in done) for name in ("touched", "left"))
    nearest = np.floor(min(100 * one.clearance for one in done))
    across, turned = options.within
    say(
        f"\n{parked} of {len(done)} parked, within {100 * across:g} cm and {turned:g} degrees, "
        f"poses known within {100 * options.start:g} cm and "
        f"{np.degrees(options.heading):g} degrees; {touched} touched anything, {left} left a tube, "
        f"nearest {nearest:.0f} cm. Times are driven: none to plan, which takes "
        f"{rounded_up(1e3 * max(one.thought for one in done))} ms at most while a car rolls."
    )
    verify = f" Verify with: parc-jax check {options.out}/case_N.json"
    say(f"Files and pictures: {options.out}." + verify * any(one.commitments for one in done))
    told = ("reached", "proved", "touched", "left", "clearance", "why", "seconds")
    rows = [{name: getattr(one, name) for name in told} | {"off": one.off.tolist()} for one in done]
    options.out.mkdir(parents=True, exist_ok=True)
    sheet(options.out / "cases.png", [case(number, options.file) for number in listed], done)
    (options.out / "cases.json").write_text(
        as_json.dumps(dict(zip(map(str, listed), rows, strict=True)))
    )
    return done


def good(done: list[Parked]) -> bool:
    """Are all parked, proved, without a contact and inside their tubes?"""
    return all(one.reached and one.proved and not (one.touched or one.left) for one in done)
