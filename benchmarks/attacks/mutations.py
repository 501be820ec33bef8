"""Which small changes go unnoticed? `python -m benchmarks.attacks mutations [FILE ..] [--days N]`.

cosmic-ray (the extra `mutation`) changes one operator, number or condition of a file at a time, in
a copy of the code; the tests of that file must then fail. Some changes alter nothing that can be
observed: files of CORE allow as many survivors as were read and found harmless, and no more.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import tyro

from benchmarks.attacks.fault import ROOT
from benchmarks.attacks.faults import Copy


class Guard(NamedTuple):
    """tests: files that guard a module, the cheapest first. survivors: changes they may miss; None
    until the list of a first night has been read.
    """

    tests: tuple[str, ...]
    survivors: int | None = None


CORE = {
    "parc_jax/checker/claim.py": Guard(
        ("tests/checker/test_checker_claim.py", "tests/checker/test_checker_premises.py")
    ),
    # words and their lengths, `frozen`, `sort_keys` of lists, the bare star of a signature
    "parc_jax/common/premises.py": Guard(("tests/claim/test_premises.py",), 11),
    "parc_jax/learning/bound/counts.py": Guard(("tests/claim/test_counts.py",)),
    # a default that the tests of its one caller see
    "parc_jax/safe_set/separation/inequality.py": Guard(
        ("tests/separation/test_inequality.py", "tests/separation/test_segment.py"), 2
    ),
    "parc_jax/safe_set/verdict/pointwise.py": Guard(
        ("tests/verdict/test_pointwise.py", "tests/soundness/test_known_plans.py")
    ),
}
LONGEST_S = 600  # one run of the tests; a change that hangs them is noticed
# One change per kind of mistake: the other operators of a place are noticed by the same tests.
EXCLUDED = (
    "core/ReplaceBinaryOperator_(?!Add_Sub|Sub_Add|Mul_Div|Div_Mul|FloorDiv_Mul|Pow_Mul"
    "|BitOr_BitAnd|BitAnd_BitOr)",
    "core/ReplaceComparisonOperator_(?!Lt_LtE|LtE_Lt|Gt_GtE|GtE_Gt|Eq_NotEq|NotEq_Eq"
    "|Is_IsNot|IsNot_Is)",
    "core/ReplaceUnaryOperator_(?!USub_UAdd|Delete)",
    "core/Variable",
)


@dataclass(frozen=True)
class Options:
    """The changes to try."""

    files: tyro.conf.Positional[tuple[str, ...]] = ()
    """Files to change; default: those of the core."""
    days: int = 0
    """Only lines that commits of so many days have touched; default files: all of parc_jax."""
    path: Path | None = None
    """Folder of sessions: a stopped campaign about the same code goes on."""


def tests_of(file: str) -> tuple[str, ...]:
    """Test files that guard a file: of the core as listed, of others those that import it."""
    if file in CORE:
        return CORE[file].tests
    module = file.removesuffix(".py").replace("/", ".")
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    importing = (path for path in files if f"from {module} import" in path.read_text())
    return tuple(str(path.relative_to(ROOT)) for path in importing)


def settings(file: str, since: str | None) -> str:
    """cosmic-ray's settings for one file; since: the commit whose later lines alone are changed."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
    lines = [
        "[cosmic-ray]",
        f'module-path = "{file}"',
        f"timeout = {LONGEST_S}.0",
        "excluded-modules = []",
        f'test-command = "{" ".join([*command, *tests_of(file)])}"',
        '[cosmic-ray.distributor]\nname = "local"',
        f"[cosmic-ray.filters.operators-filter]\nexclude-operators = {json.dumps(EXCLUDED)}",
    ]
    return "\n".join([*lines, f'[cosmic-ray.filters.git-filter]\nbranch = "{since}"\n'])


def survivors(dump: str) -> tuple[list[str], int]:
    """Unnoticed changes, as "line N of FUNCTION: OPERATOR", and the number of those tried."""
    rows = [json.loads(line) for line in dump.splitlines()]
    tried = [(w["mutations"][0], r) for w, r in rows if r and r["worker_outcome"] != "skipped"]
    missed = [
        f"line {change['start_pos'][0]} of {change['definition_name']}: {change['operator_name']}"
        for change, result in tried
        if result["test_outcome"] == "survived"
    ]
    return sorted(missed), len(tried)


def mutate(copy: Copy, file: str, session: Path, since: str | None) -> tuple[list[str], int]:
    """Try the changes of a file that the session lacks. Returns `survivors`."""
    config = copy.root / "cosmic-ray.toml"
    config.write_text(settings(file, since))
    failed, passed = copy.run(tests_of(file), LONGEST_S)
    if failed or not passed:
        raise SystemExit(f"mutations: expected passing tests of {file}; failed: {failed}.")
    if not session.exists():
        _call(copy, "cosmic-ray", "init", config, session)
        _call(copy, "cr-filter-operators", session, config)
        if since:
            _call(copy, "cr-filter-git", "--config", config, session)
    _call(copy, "cosmic-ray", "exec", config, session)
    return survivors(_call(copy, "cosmic-ray", "dump", session))


def _call(copy: Copy, program: str, *arguments) -> str:
    """Output of a program of cosmic-ray, which stands beside this Python or on the path."""
    beside = Path(sys.executable).with_name(program)
    found = str(beside) if beside.exists() else shutil.which(program)
    if found is None:
        raise SystemExit(f"mutations: expected {program}; try pip install -e '.[mutation]'.")
    environment = os.environ | {"PYTHONPATH": str(copy.root)}
    if program == "cr-filter-git":  # the copy is no repository: compare it with our history
        directory = _git("rev-parse", "--absolute-git-dir")
        environment |= {"GIT_DIR": directory, "GIT_WORK_TREE": str(copy.root)}
    command = [found, *map(str, arguments)]
    return subprocess.run(
        command, cwd=copy.root, env=environment, check=True, capture_output=True, text=True
    ).stdout


def _git(*arguments: str) -> str:
    done = subprocess.run(("git", *arguments), cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def main(arguments: list[str]) -> int:
    """The command. Exit code 1 where a file of the core has more survivors than it allows."""
    options = tyro.cli(Options, args=arguments, description=__doc__)
    files, since = options.files or tuple(CORE), None
    if options.days:
        before = f"--before={options.days} days ago"
        since = _git("rev-list", "-1", before, "HEAD") or _git(
            "rev-list", "-1", "--max-parents=0", "HEAD"
        )
        changed = _git("diff", "--name-only", "--diff-filter=AM", since, "--", "parc_jax/*.py")
        files = options.files or tuple(changed.splitlines())
    worse = []
    with tempfile.TemporaryDirectory() as folder:
        copy, sessions = Copy(folder), (options.path or Path(folder)).absolute()
        sessions.mkdir(parents=True, exist_ok=True)
        for file in files:
            if not tests_of(file):
                print(f"{file}: no test imports it")
                continue
            session = sessions / f"{file.replace('/', '.')}.sqlite"
            missed, tried = mutate(copy, file, session, since)
            for line in missed:
                print(f"{file}, {line}")
            print(f"{tried - len(missed)} of {tried} changes of {file} noticed", flush=True)
            allowed = CORE[file].survivors if file in CORE else None
            worse += [file] if allowed is not None and len(missed) > allowed else []
    if worse:
        print(f"more survivors than allowed: {', '.join(worse)}")
    return int(bool(worse))
