"""How many programs each test file compiles, and a budget for it: part of every run of the tests.

A program costs 0.1 to 5 s of a processor, on every machine alike; seconds depend on the machine, so
programs are what is guarded. Those found in a folder of compiled ones count too. The budgets are in
compile_budget.toml.
"""

import tomllib
from collections import Counter
from pathlib import Path

import pytest

DEFAULT = "not slow and not night"  # -m of pyproject.toml
BUDGET = Path(__file__).with_name("compile_budget.toml")
IMPORTS = "imports of test files, in all workers"
_SECONDS: list[float] = []
_IMPORTS: list[int] = []
_COUNTED: Counter = Counter()  # in the process that reports
_SPENT: Counter = Counter()


def too_many(counted, budget: dict, whole: bool) -> list[str]:
    """A line for each budget that {file: programs} exceeds; of the sum only after a whole run."""
    own, few = budget["files"], budget["unlisted"]
    found = [
        f"{file} compiled {n} programs, its budget is {own.get(file, few)}"
        for file, n in sorted(counted.items())
        if file != IMPORTS and n > own.get(file, few)
    ]
    total = sum(counted.values())
    if whole and total > budget["whole"]:
        most = max(counted, key=counted.get)
        said = f"all tests compiled {total} programs, the budget is {budget['whole']}"
        found.append(f"{said}; most of them {most}")
    return found


def pytest_sessionstart():
    """JAX is imported after conftest has said on what it runs."""
    import jax

    def listen(event, seconds, **_):
        if event.endswith("backend_compile_duration"):
            _SECONDS.append(seconds)

    jax.monitoring.register_event_duration_secs_listener(listen)


def pytest_collection_finish():
    """What imports of test files compile belongs to none of them."""
    _IMPORTS.append(len(_SECONDS))
    _SECONDS.clear()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """Each phase of a test carries what was compiled in it, from a worker too."""
    report = yield
    report.compiled = (len(_SECONDS), sum(_SECONDS), sum(_IMPORTS))
    _SECONDS.clear()
    _IMPORTS.clear()
    return report


def pytest_runtest_logreport(report):
    """Sums by file, in the process that all workers report to."""
    count, spent, imports = getattr(report, "compiled", (0, 0.0, 0))
    _COUNTED[IMPORTS] += imports
    file = report.nodeid.split("::")[0]
    _COUNTED[file] += count
    _SPENT[file] += spent


def pytest_sessionfinish(session):
    """A run of the default tests that compiles more than its budgets fails."""
    if _exceeded(session.config) and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter, config):
    """Files that compile most, and budgets that were exceeded."""
    total = sum(_COUNTED.values())
    if not total:
        return
    shown = None if config.option.verbose > 0 else 10
    terminalreporter.section(f"{total} programs compiled")
    for file, count in _COUNTED.most_common(shown):
        if count:
            terminalreporter.write_line(f"{count:5d} programs {_SPENT[file]:7.1f} s  {file}")
    for line in _exceeded(config):
        terminalreporter.write_line(f"FAILED: {line} ({BUDGET.name}; docs/testing.md)", red=True)


def _exceeded(config) -> list[str]:
    if hasattr(config, "workerinput") or config.option.markexpr != DEFAULT:
        return []
    whole = config.args_source is config.ArgsSource.TESTPATHS and not config.option.keyword
    return too_many(_COUNTED, tomllib.loads(BUDGET.read_text()), whole)
