"""`python -m benchmarks.suite --size small`: run entries, freeze their answers, score them."""

import argparse
import json
import secrets
import sys
import time
from pathlib import Path

from benchmarks.suite.bad import Refused
from benchmarks.suite.enter import OURS, enter
from benchmarks.suite.fresh import fresh
from benchmarks.suite.instances import SIZES, instances
from benchmarks.suite.result import SCORES, freeze, scored
from benchmarks.suite.table import figure, table


def main(arguments: list[str] | None = None) -> int:
    """Exit codes: 0 done, 2 bad input."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.suite", description=__doc__)
    parser.add_argument("--size", choices=SIZES, default=SIZES[0], help="small is in the others")
    parser.add_argument("--only", nargs="+", default=(), metavar="ID", help="ids begin with these")
    parser.add_argument(
        "--entries", nargs="+", default=OURS, metavar="NAME", help="of ours, or ./folders"
    )
    parser.add_argument("--out", type=Path, default=Path("runs/suite"), help="folder of results")
    parser.add_argument("--keep", type=Path, help="keep here where they work, and what they print")
    parser.add_argument("--score", action="store_true", help="score what is frozen there, only")
    parser.add_argument(
        "--instances",
        metavar="SEED",
        help="scenes that nobody has seen: those of the size, moved; draw it when entries are done",
    )
    parser.add_argument("--again", action="store_true", help="score with the chance of before")
    parser.add_argument("--figure", type=Path, help="draw the scores of these, e.g. x.png")
    options = parser.parse_args(arguments)
    try:
        return _run(options)
    except Refused as why:
        print(f"suite: {why}", file=sys.stderr)
        return 2


def _run(options) -> int:
    def say(line):
        print(line, file=sys.stderr, flush=True)

    begin = time.monotonic()
    asked, moved_by = instances(options.size, options.only), options.out / "instances.txt"
    enters = not (options.score or options.again)
    seed = options.instances
    if seed is None and not enters and moved_by.exists():
        seed = moved_by.read_text()
    if seed is not None:
        asked = [fresh(one, seed) for one in asked]
    if enters:
        options.out.mkdir(parents=True, exist_ok=True)
        if (moved_by.read_text() if moved_by.exists() else seed) != seed:
            raise Refused(f"--out: expected a folder for these instances; {options.out} has others")
        if seed is not None:
            moved_by.write_text(seed)
        for entry in options.entries:
            found = enter(entry, asked, say, options.keep)
            freeze(options.out, Path(entry).name, found)
    if options.again:
        if not (options.out / SCORES).exists():
            raise Refused(f"--again: expected scores in {options.out}; there are none yet.")
        report = json.loads((options.out / SCORES).read_text())
        for one in asked:
            if known := report["instances"].get(one.id):
                report = scored(options.out, [one], known["chance"], say)
    else:
        report = scored(options.out, asked, secrets.token_hex(32), say)
    found = {one.id: report["instances"].get(one.id) for one in asked}
    report |= {"instances": {name: one for name, one in found.items() if one}}
    missing = len(asked) - len(report["instances"])
    if missing == len(asked):
        raise Refused(
            f"expected scores of what was asked for in {options.out}; there are none yet."
        )
    if missing:
        say(f"{missing} of {len(asked)} instances that were asked for have no scores yet")
    print(table(report))
    say(f"{time.monotonic() - begin:.0f} s")
    if options.figure:
        figure(report, options.figure)
    return 0


if __name__ == "__main__":
    sys.exit(main())
