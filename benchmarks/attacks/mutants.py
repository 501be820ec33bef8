"""Does the checker accept a changed answer, or episode, that is not true? By one command:
`python -m benchmarks.attacks mutants`.

Valid answers of random scenes are changed at random: numbers, multipliers, runs, patterns, bins,
hashes, and the question itself under old proofs. Whatever the checker still accepts is judged by an
oracle that shares nothing with it: samples, members of corridors and polytopes and random points of
the leaves of a no_plan part must be as they were claimed, and manoeuvres of an episode must follow
one another. One line per answer is kept in a file, so a campaign that was stopped goes on.
"""

import collections
import json
import sys
from dataclasses import dataclass
from pathlib import Path

import tyro

HELPERS = Path(__file__).parents[2] / "tests" / "helpers"
PER_SCENE = 300  # mutants of one answer
PER_PLAN = 100  # mutants of one no_plan part; every tenth answer has one, every tenth is an episode
FIRST_SEED = 1000  # away from those of the tests


@dataclass(frozen=True)
class Options:
    """How many."""

    n: int = 20_000
    """Mutants, at least."""
    path: Path = Path("runs/attacks/mutants.jsonl")
    """Where the counts of each answer are kept; an existing file is continued."""


def main(arguments: list[str]) -> int:
    """Exit code 0 when no false mutant was accepted, else 1."""
    options = tyro.cli(Options, prog="benchmarks.attacks mutants", args=arguments)
    sys.path.insert(0, str(HELPERS))
    import episode_mutants
    import mutants

    options.path.parent.mkdir(parents=True, exist_ok=True)
    tally, done = _kept(options.path)
    while sum(tally.values()) < options.n:
        seed = FIRST_SEED + done
        if seed % 10 == 0:
            found = mutants.check_plan_mutants(seed, PER_PLAN)
        elif seed % 10 == 5:
            found = episode_mutants.check_episode_mutants(seed, PER_SCENE)
        else:
            found = mutants.check_mutants(seed, PER_SCENE)
        with options.path.open("a") as file:
            counts = [[*key, count] for key, count in found.items()]
            file.write(json.dumps({"seed": seed, "counts": counts}) + "\n")
        tally += found
        done += 1
    print(table(tally))
    return int(any(verdict == "false" for _, verdict in tally))


def _kept(path: Path) -> tuple[collections.Counter, int]:
    """Counts of the answers in the file, and how many they are."""
    tally, done = collections.Counter(), 0
    for line in path.read_text().splitlines() if path.exists() else ():
        for kind, verdict, count in json.loads(line)["counts"]:
            tally[kind, verdict] += count
        done += 1
    return tally, done


def table(tally: collections.Counter) -> str:
    """A table in Markdown: kind of change, rejected, accepted and true, accepted and false."""
    lines = ["| change | rejected | accepted, true | accepted, false |", "|---|---|---|---|"]
    for kind in sorted({kind for kind, _ in tally}):
        counts = [tally[kind, verdict] for verdict in ("rejected", "accepted", "false")]
        lines.append(f"| {kind} | {' | '.join(map(str, counts))} |")
    totals = [
        sum(count for (_, found), count in tally.items() if found == verdict)
        for verdict in ("rejected", "accepted", "false")
    ]
    lines.append(f"| all {sum(totals):,} | {' | '.join(f'{x:,}' for x in totals)} |")
    return "\n".join(lines)
