"""Would the tests notice? `python -m benchmarks.attacks faults [--only NAME ..] [--tables ..]`.

The code is copied, and one fault after another is planted in the copy: a sign, an index, a
comparison, a row that is dropped. The test named for it runs and must fail; on the clean copy it
must pass. A fault whose text no longer stands in the code is an error too, so that the table keeps
up with the code.
"""

import itertools
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import tyro

from benchmarks.attacks import (
    faults_checker,
    faults_claims,
    faults_proof,
    faults_use,
    faults_verdict,
)
from benchmarks.attacks.fault import ROOT, Fault

TABLES: dict[str, tuple[Fault, ...]] = {
    "checker": faults_checker.FAULTS,
    "verdict": faults_verdict.FAULTS,
    "claims": faults_claims.FAULTS,
    "proof": faults_proof.FAULTS,
    "use": faults_use.FAULTS,
}
FAULTS: tuple[Fault, ...] = tuple(itertools.chain(*TABLES.values()))
COPIED = ("parc_jax", "sims", "benchmarks", "tests", "docs", "pyproject.toml", "README.md")
LEFT_OUT = shutil.ignore_patterns("__pycache__", ".*", "site", "*.gif", "*.png", "*.pdf")
LONGEST_S = 600.0  # one run of pytest with a fault; longer counts as not noticed
FAILED, PASSED = ("FAILED ", "ERROR "), ("PASSED ",)


@dataclass(frozen=True)
class Options:
    """Which faults."""

    only: tuple[str, ...] = ()
    """These faults; default: all."""
    tables: tuple[str, ...] = ()
    """Those of these tables; default: of all."""
    sample: int = 0
    """So many faults at random; 0 = all."""
    seed: int = 0
    """Seed of the sample."""
    list: bool = False
    """Print the table, check that it fits the code, run nothing."""
    path: Path | None = None
    """Keep what was noticed in this file, and do not try it again: a stopped campaign goes on."""


def chosen(options: Options) -> list[Fault]:
    """The faults asked for. Raises SystemExit for a name that is not there."""
    for asked, kind in ((options.only, "faults"), (options.tables, "tables")):
        names = {fault.name for fault in FAULTS} if kind == "faults" else set(TABLES)
        if unknown := [name for name in asked if name not in names]:
            raise SystemExit(f"faults: expected names of {kind}; got {', '.join(unknown)}.")
    of_tables = [fault for name in options.tables or TABLES for fault in TABLES[name]]
    faults = [fault for fault in of_tables if not options.only or fault.name in options.only]
    if options.sample:
        faults = random.Random(options.seed).sample(faults, min(options.sample, len(faults)))
    return faults


def misfits(faults=FAULTS) -> list[str]:
    """Faults whose text or tests are not in the code, one line each; and names that occur twice."""
    names = [fault.name for fault in faults]
    twice = sorted({name for name in names if names.count(name) > 1})
    found = [f"{fault.name}: {why}" for fault in faults if (why := fault.missing())]
    return found + [f"{name}: two faults of this name" for name in twice]


class Copy:
    """A copy of the code in a temporary folder, in which faults are planted and tests run."""

    def __init__(self, folder: str):
        self.root = Path(folder)
        self._stamp = int(time.time()) + 10
        for name in COPIED:
            source = ROOT / name
            if source.is_dir():
                shutil.copytree(source, self.root / name, ignore=LEFT_OUT)
            elif source.exists():
                shutil.copy(source, self.root / name)

    def notices(self, fault: Fault) -> bool:
        """Its test fails while it is planted."""
        path, good, bad = fault.planted(self.root)
        self._write(path, bad)
        try:
            failed, _ = self.run([fault.test], LONGEST_S)
        finally:
            self._write(path, good)
        return any(_case_of(fault.test, case) for case in failed)

    def run(self, tests, longest: float | None = None) -> tuple[list[str], list[str]]:
        """Cases of tests that failed and that passed. A run that takes too long has neither."""
        command = [sys.executable, "-m", "pytest", "-q", "-rA", "--tb=no", "-p", "no:cacheprovider"]
        environment = os.environ | {"PYTHONPATH": str(self.root), "COLUMNS": "400"}
        try:
            done = subprocess.run(
                [*command, "-m", "", *tests],
                cwd=self.root,
                env=environment,
                capture_output=True,
                text=True,
                timeout=longest,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return [], []
        lines = done.stdout.splitlines()
        return _cases(lines, FAILED), _cases(lines, PASSED)

    def _write(self, path: Path, text: str) -> None:
        """With a new time, or compiled code of the same size and second would be reused."""
        path.write_text(text)
        self._stamp += 2
        os.utime(path, (self._stamp, self._stamp))


def run(options: Options) -> int:
    """Print a line per fault. Exit code 1 when one survives, does not fit the code, or a test fails
    on the clean code.
    """
    faults = chosen(options)
    wrong = misfits(faults)
    for line in wrong:
        print(line)
    if options.list:
        for fault in faults:
            print(f"| {fault.name} | {fault.place} | {fault.test} |")
    if wrong or options.list:
        print(f"{len(faults)} faults, {len(wrong)} do not fit the code")
        return int(bool(wrong))
    if options.sample:
        print(f"a sample of {len(faults)} out of {len(FAULTS)} faults, seed {options.seed}")
    with tempfile.TemporaryDirectory() as folder:
        copy = Copy(folder)
        tests = sorted({fault.test for fault in faults})
        failed, passed = copy.run(tests)
        broken = {test for test in tests if any(_case_of(test, case) for case in failed)}
        skipped = {test for test in tests if not any(_case_of(test, case) for case in passed)}
        skipped -= broken
        for word, some in (("do not pass", broken), ("are skipped here", skipped)):
            for test in sorted(some):
                print(f"on the clean code these {word}: {test}", flush=True)
        tried = [fault for fault in faults if fault.test not in broken | skipped]
        survivors = [fault.name for fault in tried if not _noticed(copy, fault, options.path)]
    print(f"{len(tried) - len(survivors)} of {len(tried)} faults noticed")
    if len(tried) < len(faults):
        print(f"{len(faults) - len(tried)} not tried, for want of a test that passes here")
    if survivors:
        print(f"survived: {', '.join(survivors)}")
    return int(bool(survivors or broken))


def _noticed(copy: Copy, fault: Fault, path: Path | None) -> bool:
    if path is not None and path.exists() and fault.name in path.read_text().splitlines():
        return True
    begin = time.perf_counter()
    noticed = copy.notices(fault)
    said = "noticed" if noticed else f"not noticed by {fault.test}"
    print(f"{fault.name:<44} {said} ({time.perf_counter() - begin:.0f} s)", flush=True)
    if path is not None and noticed:
        with path.open("a") as kept:
            kept.write(f"{fault.name}\n")
    return noticed


def _cases(lines: list[str], heads: tuple[str, ...]) -> list[str]:
    """Node ids of the lines of pytest's summary that begin so."""
    found = [line.removeprefix(head) for head in heads for line in lines if line.startswith(head)]
    return [line.split(" - ")[0].strip() for line in found]


def _case_of(test: str, case: str) -> bool:
    return case == test or case.startswith(f"{test}[")


def main(arguments: list[str]) -> int:
    """The command."""
    return run(tyro.cli(Options, args=arguments, description=__doc__))
