"""Is what the checker accepts exactly on a border safe, by the definition? By one command:
`python -m benchmarks.attacks borders`.

Points are computed in fractions that lie exactly on a border of an accepted polytope, or meet a
condition of an accepted sample or corridor with equality, also at ends of K and where bins with
different tubes meet; some a share of 2^-40 before and beyond. Each is put to the checker, to the
conditions computed a second time, and to the definition: segments against polygons in rational
arithmetic. One line per answer is kept in a file, so a campaign that was stopped goes on.
"""

import collections
import json
import sys
from dataclasses import dataclass
from pathlib import Path

import tyro

HELPERS = Path(__file__).parents[2] / "tests" / "helpers"
RAYS = 100  # from each sample, corridor and polytope of an answer
FIRST_SEED = 1000  # away from those of the tests


@dataclass(frozen=True)
class Options:
    """How many."""

    n: int = 100_000
    """Points exactly on a border, at least."""
    path: Path = Path("runs/attacks/borders.jsonl")
    """Where the counts of each answer are kept; an existing file is continued."""


def main(arguments: list[str]) -> int:
    """Exit code 0 when nothing was wrong, else 1."""
    options = tyro.cli(Options, prog="benchmarks.attacks borders", args=arguments)
    sys.path.insert(0, str(HELPERS))
    import borders

    options.path.parent.mkdir(parents=True, exist_ok=True)
    tally, done = _kept(options.path)
    while on_border(tally) < options.n:
        found = borders.look(FIRST_SEED + done, RAYS)
        with options.path.open("a") as file:
            counts = [[key, count] for key, count in found.items()]
            file.write(json.dumps({"seed": FIRST_SEED + done, "counts": counts}) + "\n")
        tally += found
        done += 1
    print(table(tally))
    return int(any(isinstance(key, str) for key in tally))


def on_border(tally: collections.Counter) -> int:
    """Points exactly on a border."""
    return sum(count for key, count in tally.items() if key[1] == "on")


def _kept(path: Path) -> tuple[collections.Counter, int]:
    """Counts of the answers in the file, and how many they are."""
    tally, done = collections.Counter(), 0
    for line in path.read_text().splitlines() if path.exists() else ():
        for key, count in json.loads(line)["counts"]:
            tally[tuple(key) if isinstance(key, list) else key] += count
        done += 1
    return tally, done


def table(tally: collections.Counter) -> str:
    """A table in Markdown, and what was wrong."""
    lines = ["| border of | where | accepted | refused |", "|---|---|---|---|"]
    places = sorted({key[:2] for key in tally if not isinstance(key, str)})
    for kind, where in places:
        counts = [tally[kind, where, verdict] for verdict in ("in", "out")]
        lines.append(f"| {kind} | {where} | {counts[0]:,} | {counts[1]:,} |")
    lines.append(f"\n{on_border(tally):,} points exactly on a border.")
    wrong = [f"{key}: {count}" for key, count in tally.items() if isinstance(key, str)]
    return "\n".join([*lines, *(wrong or ["Nothing was wrong."])])
