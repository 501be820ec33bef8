"""What an episode rests on, told from the file: entries of name, standing and value.

Those that the file itself shows are made here, anew, and the file's must be the same; what it adds
is measured or assumed. Numbers are told to twelve decimals; the file has them exactly.
"""

import itertools
import re
from collections.abc import Iterator
from fractions import Fraction

from .claim import at
from .entries import canonical
from .exact import array, decimal, need, number, whole

CHECKED, ASSUMED = "checked", "assumed"
ADDED = ("measured", ASSUMED)  # the standings of what a file may add
LONGEST = 2000  # characters of an entry that are printed
LEFT = re.compile(r"a chain of .*left after (\S+) to (\S+) s")  # in a law of k
SAME = Fraction(1, 10**9)  # [s] by which times may differ
ON_THE_ROBOT = "told from the pose of each manoeuvre, in the robot's own frame"
IN_THE_WORLD = "told in the world"


def known_premises(episode: dict) -> list:
    """The entries that the file shows."""
    entries = array(episode["manoeuvres"])
    need(len(entries) > 0, "an episode without a manoeuvre")
    begins = [number(entry["begin"]) for entry in entries]
    problems = [entry["problem"] for entry in entries]
    first, n = problems[0], len(entries)
    n_p, copies = whole(first["n_p"], 1, 8), whole(episode["copies"], 1, first["points"])
    steps, dt = whole(first["steps"], 1, 100_000), number(first["dt"])
    *start, heading, drift = doubt_of(episode, n_p)
    turned = len(entries[0]["pose"]) > n_p
    points = first["points"] // copies
    apart = [b - a for a, b in itertools.pairwise(begins)]
    spans = f", {seconds(min(apart))} to {seconds(max(apart))} apart" if apart else ""
    obstacles = [problem["obstacles"] for problem in problems]
    moving = sum(any("steps" in part for part in some) for some in obstacles)
    frame = ON_THE_ROBOT if turned else IN_THE_WORLD
    odd = left_otherwise(episode["claim"], apart, steps * dt)
    off = [f"within {', '.join(f'±{decimal(x)}' for x in start)} m of the truth"]
    off += [f"within ±{decimal(heading)} rad"] if turned or heading else []
    told = [
        ["manoeuvres", CHECKED, f"{n}, of {steps} steps of {decimal(dt)} s each"],
        ["begins", CHECKED, f"{seconds(begins[0])} to {seconds(begins[-1])}{spans}"],
        ["end", CHECKED, seconds(begins[-1] + steps * dt)],
        ["body", CHECKED, [part_of(part, copies) for part in first["body"]["parts"]]],
        ["frame", CHECKED, frame],
        ["tube", CHECKED, "of each manoeuvre from its stated pose alone"],
        [
            "obstacles",
            CHECKED,
            f"{min(map(len, obstacles))} to {max(map(len, obstacles))} a manoeuvre, told of by "
            f"intervals in {moving}",
        ],
    ]
    if turned:
        shown = f"{points} reference points, within their errors, show no other"
        shown = shown if points > 1 else "one reference point shows none"
        told.append(["heading", ASSUMED, f"that of the poses: {shown}"])
        same = "a run with another heading is the same run, turned, as far as the claim allows"
        told.append(["ROTATION_INVARIANCE", ASSUMED, same])  # whatever a claim leaves out
    return [
        *told,
        ["poses", ASSUMED, [*off, f"{decimal(drift)} m of drift from one to the next"]],
        ["room", ASSUMED, "each manoeuvre was asked with room for what its pose may be off"],
        ["places", ASSUMED, f"obstacles are where each problem has them, {frame}"],
        ["hand-over", ASSUMED, f"each is followed from its begin until that of the next{odd}"],
        ["k", ASSUMED, "each was driven with its k, of which what is measured was so at its begin"],
        ["rest", ASSUMED, "the robot stays where a manoeuvre came to its end"],
    ]


def left_otherwise(claim: dict | None, apart: list, lasts: Fraction) -> str:
    """How many manoeuvres were left when no run of a claim about chains was, of those that were
    left before their end; empty for other claims.
    """
    said = LEFT.match(str(at(claim, "law", "k_law")))
    if said is None:
        return ""
    first, last = map(number, said.groups())
    odd = sum(x < lasts and not first - SAME <= x <= last + SAME for x in apart)
    return f"; {odd} of {len(apart)} were left when no run of the claim was"


def checked_premises(episode: dict) -> list:
    """The whole record of a file. Rejects one that tells otherwise what the file shows, or calls
    checked what it does not.
    """
    known, given = known_premises(episode), array(episode["premises"])
    for entry, shown in itertools.zip_longest(given[: len(known)], known):
        same = canonical(entry) == canonical(shown)
        need(same, f"the premise {shown[0]} is not what the file shows: drive again, and save that")
    for entry in given[len(known) :]:
        name, standing, value = array(entry, 3)
        need(type(name) is str and kept(value), "a premise is no name with text or whole numbers")
        need(standing in ADDED, "a premise is called checked that the file does not show")
    names = [name for name, _, _ in given]
    need(len(set(names)) == len(names), "a premise stands there twice")
    return given


def kept(value: object) -> bool:
    """Is it text, a whole number, or a list of such?"""
    return all(map(kept, value)) if isinstance(value, list) else type(value) in (str, int)


def lines_of(record: list) -> Iterator[str]:
    """A line for each entry, fit for a terminal."""
    for name, standing, value in record:
        yield f"  {standing} {printable(name)}: {printable(text_of(value))}"


def text_of(value: object) -> str:
    """A value for people."""
    return "; ".join(map(text_of, value)) if isinstance(value, list) else str(value)


def printable(text: str) -> str:
    """What of a text may be printed; of a long one it is said how long it is."""
    shown = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text[:LONGEST])
    return shown if len(text) <= LONGEST else f"{shown}... ({len(text)} characters)"


def doubt_of(episode: dict, n_p: int) -> list:
    """What a pose may be off by: half widths [m] of its place, [rad] of its heading, and [m] by
    which odometry drifts from one pose to the next.
    """
    doubt = [number(x) for x in array(episode["doubt"])]
    fits = len(doubt) == n_p + 2 and all(x >= 0 for x in doubt)
    need(fits, "a doubt is one number for each axis, for the heading and for the drift")
    return doubt


def part_of(part: dict, copies: int) -> str:
    """A part of the body in words, by the robot's own points."""
    points = ", ".join(map(str, sorted({i // copies for i in part["points"]})))
    hull = f"hull of points {points}" if "," in points else f"point {points}"
    if "radius" in part:
        return f"{hull} grown by {decimal(number(part['radius']))} m"
    corners = [f"({', '.join(decimal(number(x)) for x in at)})" for at in part["vertices"]]
    return f"{hull} grown by the polygon {', '.join(corners)} m, which never turns"


def seconds(time: Fraction) -> str:
    """A time for people."""
    return f"{decimal(time)} s"
