"""Programs and seconds of compiling, by test file:
`PYTHONPATH=tests/helpers pytest -p compile_report -n 2`.
"""

from collections import Counter

import pytest

_SECONDS: list[float] = []


def pytest_sessionstart():
    """JAX is imported after conftest has said on what it runs."""
    import jax

    def listen(event, seconds, **_):
        if event.endswith("backend_compile_duration"):
            _SECONDS.append(seconds)

    jax.monitoring.register_event_duration_secs_listener(listen)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """Each phase of a test carries what was compiled in it, from a worker too."""
    report = yield
    report.compiled = (len(_SECONDS), sum(_SECONDS))
    _SECONDS.clear()
    return report


def pytest_terminal_summary(terminalreporter):
    """Files that compile longest first."""
    programs, seconds = Counter(), Counter()
    for reports in terminalreporter.stats.values():
        for report in reports:
            count, spent = getattr(report, "compiled", (0, 0.0))
            file = getattr(report, "nodeid", "").split("::")[0]
            programs[file] += count
            seconds[file] += spent
    terminalreporter.section("compiled")
    for file, spent in seconds.most_common():
        terminalreporter.write_line(f"{spent:8.1f} s {programs[file]:5d} programs  {file}")
