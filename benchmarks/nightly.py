"""What takes hours: `python -m benchmarks.nightly` (`.ci/nightly` installs what it needs first).

Campaigns run one after another, each a command of its own with one line of result. What is finished
for this code is not run again, so a night that was stopped goes on. The page docs/nightly.md is
written anew after every campaign, with commit and date.
"""

import hashlib
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import tyro

from benchmarks.attacks.promises import PROMISES

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "nightly.md"
CODE = ("parc_jax", "sims", "benchmarks", "tests", "pyproject.toml", ".ci")  # what results are of
FOREIGN = ROOT / ".venv-foreign" / "bin" / "python"  # simulators whose needs may move versions
NO_TESTS = 5  # pytest's exit code where a folder has none of the marked ones
SUMMARY = re.compile(r"^=* ?(\d+ (?:passed|failed|error).*?) ?=*$")


@dataclass(frozen=True)
class Campaign:
    """One command. name: of its files and its row. tries: what it does, for people."""

    name: str
    tries: str
    command: tuple[str, ...]


@dataclass(frozen=True)
class Result:
    """What came of a campaign. code: exit status. line: the one line of result."""

    name: str
    tries: str
    commit: str
    day: str
    code: int
    seconds: float
    line: str

    @property
    def passed(self) -> bool:
        """The command ended well; a folder without marked tests does too."""
        return self.code in (0, NO_TESTS)


@dataclass(frozen=True)
class Options:
    """Which campaigns, and where their results are kept."""

    only: tuple[str, ...] = ()
    """These campaigns; default: all."""
    folder: Path = ROOT / "runs" / "nightly"
    """Logs and results, a folder for each state of the code."""
    again: bool = False
    """Also what is finished."""
    list: bool = False
    """Print the campaigns and run nothing."""


def campaigns(kept: Path) -> list[Campaign]:
    """All of the night. kept: folder of the results, where the long ones note how far they are."""
    attack = (sys.executable, "-m", "benchmarks.attacks")
    foreign = str(FOREIGN) if FOREIGN.exists() else sys.executable
    return [
        *(_tests_of(folder) for folder in _folders()),
        Campaign(
            "foreign",
            "black boxes that nobody here wrote: their own simulators, studies and replays",
            (foreign, "-m", "pytest", "-q", "-m", "", "--no-header", "tests/sims/foreign"),
        ),
        Campaign(
            "mutants",
            "answers changed at random against an oracle of its own",
            (*attack, "mutants", "--path", str(kept / "mutants.jsonl")),
        ),
        Campaign(
            "borders",
            "points exactly on a border, in fractions",
            (*attack, "borders", "--path", str(kept / "borders.jsonl")),
        ),
        *(
            Campaign(
                f"coverage-{promise.name}",
                "how often this promise is broken, on a robot known exactly",
                (*attack, "coverage", "--only", promise.name, "--repeats", "300"),
            )
            for promise in PROMISES
            if not promise.control
        ),
        Campaign(
            "faults",
            "every planted fault: the tests named for it must fail",
            (*attack, "faults", "--path", str(kept / "faults.jsonl")),
        ),
    ]


def _folders() -> list[Path]:
    """Folders of tests; those at the top count as one, the foreign ones have their own campaign."""
    return sorted({path.parent for path in (ROOT / "tests").glob("**/test_*.py")} - {_FOREIGN})


_FOREIGN = ROOT / "tests" / "sims" / "foreign"


def _tests_of(folder: Path) -> Campaign:
    files = sorted(str(path.relative_to(ROOT)) for path in folder.glob("test_*.py"))
    name = folder.relative_to(ROOT / "tests").as_posix().replace("/", "-").strip(".") or "top"
    marked = (sys.executable, "-m", "pytest", "-q", "--no-header", "-m", "slow or night")
    return Campaign(
        f"tests-{name}", "long tests and those of the night", (*marked, "--timeout=7200", *files)
    )


def code_hash() -> str:
    """Of the committed code that results are about. Raises SystemExit where it has changed."""
    changed = _git("status", "--porcelain", "--", *CODE)
    if changed:
        raise SystemExit(f"nightly: expected committed code; changed since:\n{changed}")
    return hashlib.sha256(_git("ls-tree", "HEAD", "--", *CODE).encode()).hexdigest()[:16]


def _git(*arguments: str) -> str:
    done = subprocess.run(("git", *arguments), cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def run_campaign(campaign: Campaign, kept: Path, commit: str) -> Result:
    """Run one; its output goes into a file of its name."""
    environment = os.environ | {"PARC_JAX_NIGHT": "1", "PYTHONPATH": str(ROOT)}
    log = kept / f"{campaign.name}.log"
    begin = time.perf_counter()
    with log.open("w") as out:
        code = subprocess.call(
            campaign.command, cwd=ROOT, env=environment, stdout=out, stderr=subprocess.STDOUT
        )
    seconds = time.perf_counter() - begin
    line = last_line(log.read_text(errors="replace"), code)
    day = date.today().isoformat()
    return Result(campaign.name, campaign.tries, commit, day, code, seconds, line)


def last_line(text: str, code: int) -> str:
    """The line that says what came of it: pytest's summary, or the last one that says anything."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    summaries = [found[1] for line in lines if (found := SUMMARY.match(line))]
    said = (summaries or lines or [f"nothing, exit code {code}"])[-1]
    return said.replace("|", "/")[:200]


def page(results: Sequence[Result], n_campaigns: int) -> str:
    """The table of docs/nightly.md, of so many campaigns in all."""
    states = sorted({f"{result.commit}, {result.day}" for result in results})
    hours = sum(result.seconds for result in results) / 3600
    failed = [result.name for result in results if not result.passed]
    missing = n_campaigns - len(results)
    whole = f"Still to be run: {missing} of {n_campaigns} campaigns. " if missing else ""
    rows = [
        f"| `{r.name}` | {r.tries} | {'' if r.passed else '**failed**: '}{r.line} "
        f"| {r.seconds / 60:.1f} |"
        for r in results
        if r.code != NO_TESTS
    ]
    return "\n".join(
        [
            "# What the night found",
            "",
            "Written by `.ci/nightly`, a line for each campaign; [testing](testing.md) says what "
            "runs when, [attacks](attacks.md) what each tries.",
            "",
            f"Commit and day: {'; '.join(states)}. {os.cpu_count()} cores, Python "
            f"{platform.python_version()}, {hours:.1f} hours in all. "
            + whole
            + (f"Failed: {', '.join(failed)}." if failed else "None failed."),
            "",
            "| campaign | what it tries | result | minutes |",
            "| --- | --- | --- | --- |",
            *rows,
            "",
        ]
    )


def run(options: Options, known: Sequence[Campaign] | None = None, to: Path = PAGE) -> int:
    """Run what is not finished and write the page. Exit code 1 where anything failed."""
    kept = options.folder / code_hash()
    kept.mkdir(parents=True, exist_ok=True)
    known = campaigns(kept) if known is None else list(known)
    unknown = set(options.only) - {campaign.name for campaign in known}
    if unknown:
        raise SystemExit(f"nightly: expected names of campaigns; got {', '.join(unknown)}.")
    if options.list:
        for campaign in known:
            print(campaign.name, shutil.which(campaign.command[0]), *campaign.command[1:])
        return 0
    results = []
    commit = _git("rev-parse", "--short", "HEAD")
    for campaign in known:
        record = kept / f"{campaign.name}.json"
        finished = Result(**json.loads(record.read_text())) if record.exists() else None
        chosen = not options.only or campaign.name in options.only
        if chosen and (options.again or finished is None or not finished.passed):
            finished = run_campaign(campaign, kept, commit)
            record.write_text(json.dumps(vars(finished), indent=1))
            print(f"{campaign.name:<28} {finished.line} ({finished.seconds:.0f} s)", flush=True)
        if finished is not None:
            results.append(finished)
            to.write_text(page(results, len(known)))
    return int(not all(result.passed for result in results))


if __name__ == "__main__":
    sys.exit(run(tyro.cli(Options, description=__doc__)))
