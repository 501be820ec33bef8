"""What takes hours: `python -m benchmarks.nightly` (`.ci/nightly` installs what it needs first).

Each campaign is a command of its own with one line of result; as many run at a time as `--jobs`, by
default as there are cores. What is finished for the files that it reads is not run again, so a
night that was stopped, or whose tests were mended, goes on. The page docs/nightly.md is written
anew after every campaign: the last result of each, with commit and date.
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
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path

import tyro

from benchmarks.attacks.faults import TABLES
from benchmarks.attacks.mutations import CORE
from benchmarks.attacks.promises import PROMISES

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "nightly.md"
CODE = ("parc_jax", "sims", "benchmarks", "pyproject.toml", ".ci")  # what all results are of
ALL_TESTS = ("tests/helpers", "tests/conftest.py")  # and those of tests
FOREIGN = ROOT / ".venv-foreign" / "bin" / "python"  # simulators whose needs may move versions
FOREIGN_TESTS = "tests/sims/foreign"
NO_TESTS = 5  # pytest's exit code where a folder has none of the marked ones
DETAILS = re.compile(r"(, \d+ deselected)?(, \d+ warnings?)? in [\d.]+s( \(.*\))?$")
SUMMARY = re.compile(r"^=* ?(\d+ (?:passed|failed|error).*?) ?=*$")


@dataclass(frozen=True)
class Campaign:
    """One command. name: of its files and its row. tries: what it does, for people. reads: files
    that its result is of. In the command, KEPT is a folder in which it may note how far it is.
    """

    name: str
    tries: str
    command: tuple[str, ...]
    reads: tuple[str, ...] = CODE

    def state(self) -> str:
        """Hash of what it reads, as committed."""
        listed = _git("ls-tree", "HEAD", "--", *self.reads) + "\n" + " ".join(self.command)
        return hashlib.sha256(listed.encode()).hexdigest()[:16]


KEPT = "{kept}"


@dataclass(frozen=True)
class Result:
    """What came of a campaign. code: exit status. line: the one line of result."""

    name: str
    tries: str
    state: str
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
    """Logs and results, a folder for each campaign and state of what it reads."""
    jobs: int = field(default_factory=lambda: os.cpu_count() or 1)
    """Campaigns at a time."""
    again: bool = False
    """Also what is finished."""
    list: bool = False
    """Print the campaigns and run nothing."""


def campaigns() -> list[Campaign]:
    """All of the night, the longest first."""
    attack = (sys.executable, "-m", "benchmarks.attacks")
    foreign = str(FOREIGN) if FOREIGN.exists() else sys.executable
    return [
        *(
            Campaign(
                f"faults-{name}",
                "every planted fault of this table: the test named for it must fail",
                (*attack, "faults", "--tables", name, "--path", f"{KEPT}/faults.txt"),
                (*CODE, "tests"),
            )
            for name in sorted(TABLES, key=lambda name: -len(TABLES[name]))
        ),
        *(
            Campaign(
                f"mutations-{Path(file).stem}",
                "small changes of a file of the core: its tests must fail",
                (*attack, "mutations", file, "--path", KEPT),
                (file, *guard.tests, *ALL_TESTS),
            )
            for file, guard in CORE.items()
        ),
        Campaign(
            "mutations-day",
            "small changes of the lines of a day, for the tests that import their file",
            (*attack, "mutations", "--days", "1", "--path", KEPT),
            (*CODE, "tests"),
        ),
        Campaign(
            "foreign",
            "black boxes that nobody here wrote: their own simulators, studies and replays",
            (foreign, "-m", "pytest", "-q", "-m", "", "--no-header", FOREIGN_TESTS),
            (*CODE, *ALL_TESTS, FOREIGN_TESTS),
        ),
        *(_tests_of(folder) for folder in _folders()),
        Campaign(
            "mutants",
            "answers changed at random against an oracle of its own",
            (*attack, "mutants", "--path", f"{KEPT}/mutants.jsonl"),
            (*CODE, *ALL_TESTS),
        ),
        Campaign(
            "borders",
            "points exactly on a border, in fractions",
            (*attack, "borders", "--path", f"{KEPT}/borders.jsonl"),
            (*CODE, *ALL_TESTS),
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
    ]


def _folders() -> list[Path]:
    """Folders of tests; those at the top count as one, the foreign ones have their own campaign."""
    folders = {path.parent for path in (ROOT / "tests").glob("**/test_*.py")}
    return sorted(folders - {ROOT / FOREIGN_TESTS})


def _tests_of(folder: Path) -> Campaign:
    files = sorted(str(path.relative_to(ROOT)) for path in folder.glob("test_*.py"))
    name = folder.relative_to(ROOT / "tests").as_posix().replace("/", "-").strip(".") or "top"
    marked = (sys.executable, "-m", "pytest", "-q", "--no-header", "-m", "slow or night")
    command = (*marked, "--timeout=7200", *files)
    return Campaign(
        f"tests-{name}", "long tests and those of the night", command, (*CODE, *ALL_TESTS, *files)
    )


def require_committed() -> None:
    """Raises SystemExit where what results are of has changed since the last commit."""
    changed = _git("status", "--porcelain", "--", *CODE, "tests")
    if changed:
        raise SystemExit(f"nightly: expected committed code; changed since:\n{changed}")


def _git(*arguments: str) -> str:
    done = subprocess.run(("git", *arguments), cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def run_campaign(campaign: Campaign, kept: Path, commit: str) -> Result:
    """Run one; its output and its result go into its folder."""
    kept.mkdir(parents=True, exist_ok=True)
    environment = os.environ | {"PARC_JAX_NIGHT": "1", "PYTHONPATH": str(ROOT)}
    environment.pop("TF_CPP_MIN_LOG_LEVEL", None)  # jax sets it; tests set their own
    command = [word.replace(KEPT, str(kept)) for word in campaign.command]
    begin = time.perf_counter()
    with (kept / "log").open("w") as out:
        code = subprocess.call(
            command, cwd=ROOT, env=environment, stdout=out, stderr=subprocess.STDOUT
        )
    seconds = time.perf_counter() - begin
    line = last_line((kept / "log").read_text(errors="replace"), code)
    day = date.today().isoformat()
    state = campaign.state()
    result = Result(campaign.name, campaign.tries, state, commit, day, code, seconds, line)
    (kept / "result.json").write_text(json.dumps(vars(result), indent=1))
    print(f"{campaign.name:<28} {line} ({seconds:.0f} s)", flush=True)
    return result


def last_line(text: str, code: int) -> str:
    """The line that says what came of it: pytest's summary, or the last one that says anything."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    summaries = [found[1] for line in lines if (found := SUMMARY.match(line))]
    said = (summaries or lines or [f"nothing, exit code {code}"])[-1]
    return said.replace("|", "/")[:200]


def page(results: Sequence[Result], known: Sequence[Campaign], jobs: int) -> str:
    """The table of docs/nightly.md, of all campaigns. jobs: at a time, in the last night."""
    states = sorted({f"{result.commit}, {result.day}" for result in results})
    hours = sum(result.seconds for result in results) / 3600
    failed = [result.name for result in results if not result.passed]
    missing = len(known) - len(results)
    whole = f"Still to be run: {missing} of {len(known)} campaigns. " if missing else ""
    now = {campaign.name: campaign.state() for campaign in known}
    older = [result.name for result in results if result.state != now[result.name]]
    which = "every line" if len(older) == len(results) else ", ".join(older) or "no line"
    return "\n".join(
        [
            "# Nightly: the campaigns of hours",
            "",
            "The last result of every long campaign, written by `.ci/nightly`; "
            "[testing](testing.md) says when they run, [attacks](attacks.md) explains them.",
            "",
            f"Commit and day: {'; '.join(states)}. {os.cpu_count()} cores, Python "
            f"{platform.python_version()}, {hours:.1f} hours in all, "
            f"campaigns at a time in the last night: {jobs}. "
            + whole
            + (f"Failed: {', '.join(failed)}." if failed else "None failed."),
            "",
            "A line is of the code of its commit and says nothing of later code. Older than what "
            f"it reads at {_git('rev-parse', '--short', 'HEAD')}, where this was written: {which}.",
            "",
            *_tables([result for result in results if result.code != NO_TESTS]),
        ]
    )


def _tables(results: Sequence[Result]) -> list[str]:
    """A table for all campaigns that try the same."""
    lines = []
    for tries in dict.fromkeys(result.tries for result in results):
        lines += [f"**{tries[0].upper() + tries[1:]}**", ""]
        lines += ["| campaign | result | minutes | commit |", "|---|---|---|---|"]
        lines += [
            f"| `{r.name}` | {'' if r.passed else '**failed**: '}{DETAILS.sub('', r.line)} "
            f"| {r.seconds / 60:.1f} | {r.commit} |"
            for r in results
            if r.tries == tries
        ]
        lines += [""]
    return lines


def run(options: Options, known: Sequence[Campaign] | None = None, to: Path = PAGE) -> int:
    """Run what is not finished and write the page. Exit code 1 where anything failed."""
    require_committed()
    known = campaigns() if known is None else list(known)
    unknown = set(options.only) - {campaign.name for campaign in known}
    if unknown:
        raise SystemExit(f"nightly: expected names of campaigns; got {', '.join(unknown)}.")
    if options.list:
        for campaign in known:
            print(campaign.name, shutil.which(campaign.command[0]), *campaign.command[1:])
        return 0
    commit = _git("rev-parse", "--short", "HEAD")
    kept = {c.name: options.folder / c.name / c.state() for c in known}
    finished = {c.name: found for c in known if (found := _finished(kept[c.name])) is not None}
    todo = [
        campaign
        for campaign in known
        if (not options.only or campaign.name in options.only)
        and (options.again or campaign.name not in finished or not finished[campaign.name].passed)
    ]
    before = {c.name: found for c in known if (found := _newest(options.folder / c.name))}
    with ThreadPoolExecutor(options.jobs) as pool:
        begun = [pool.submit(run_campaign, c, kept[c.name], commit) for c in todo]
        for done in as_completed(begun):
            finished[done.result().name] = done.result()
            _write(to, before | finished, known, options.jobs)
    _write(to, before | finished, known, options.jobs)
    return int(not all(result.passed for result in finished.values()))


def _finished(kept: Path) -> Result | None:
    record = kept / "result.json"
    return Result(**json.loads(record.read_text())) if record.exists() else None


def _newest(campaign: Path) -> Result | None:
    """The last result that is kept of a campaign, of whatever state of its files."""
    records = sorted(campaign.glob("*/result.json"), key=lambda path: path.stat().st_mtime)
    return _finished(records[-1].parent) if records else None


def _write(to: Path, finished: dict[str, Result], known: Sequence[Campaign], jobs: int) -> None:
    to.write_text(page([finished[c.name] for c in known if c.name in finished], known, jobs))


if __name__ == "__main__":
    sys.exit(run(tyro.cli(Options, description=__doc__)))
