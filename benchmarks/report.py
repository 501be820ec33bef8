"""The Markdown page: method first, then the results of every platform in the baseline."""

SPREAD = ("median", "p95", "max")
HEAD = """# Benchmarks

This page is written by `python -m benchmarks --update-baseline`; do not edit it.

```
python -m benchmarks                        # everything, about forty minutes on two quiet cores
python -m benchmarks --only points bras     # some workloads
python -m benchmarks --quick                # tiny sizes: does everything work? Its numbers mean nothing
python -m benchmarks --gate                 # exit code 1 if anything is worse than the committed baseline
python -m benchmarks --update-baseline      # accept the results of this run: baseline.json and this page
python -m benchmarks --device gpu --json results.json
```

## Method

* Every number is a metric with unit, direction and tolerance. What is reported is gated, by the same list: counts and
  verdicts tightly, on every machine; times loosely, and only against a baseline from the same kind of machine.
* Compile, cold and warm are apart. A time ends when the *result* is there. Warm times are repeated; median, 95th
  percentile and maximum are given, over at least 100 seeds where a query is random.
* Methods that are compared run side by side: same process, machine, model, scene and float64.
* Verdicts are float64 with a margin that covers rounding; training is float32. A metric says so when it differs.
* A workload that cannot run here is skipped and says why. A fixed piece of NumPy work (`control`) shows whether the
  machine was busy: if its spread is far from 1, distrust the times of that run, and look only at ratios and counts.
* Here are the tables of every workload, or its values; `baseline.json` beside the code has every metric with what the
  gate allows it.
* Figures of the paper are its authors', for their networks on their machine. They are marked and never gated.
* What was measured by hand, of single stages and on other days, is on [a page of its own](measured.md).
"""


def page(baselines: dict[str, dict]) -> str:
    """The whole page from the reports of all platforms."""
    parts = [HEAD, "## Results\n"]
    if not baselines:
        parts.append("None recorded yet.\n")
    for platform, report in sorted(baselines.items()):
        parts.append(results(report, f"### On {platform.upper()}", 4, metrics=False))
    return "\n".join(parts)


def results(report: dict, title: str, level: int, metrics: bool = True) -> str:
    """One report as Markdown.

    level: of the headings of its workloads. metrics: every metric with what the gate allows;
        without, a workload that has tables is its tables, and another one its values.
    """
    e = report["environment"]
    versions = ", ".join(f"{name} {version}" for name, version in e["versions"].items())
    where = (
        f"{e['device']}, {e['devices']} device(s), {e['processors']} processors, load "
        f"{e['load']} at the start"
    )
    lines = [title, "", f"{where}; {e['date']}; commit {e['commit']}; {e['dtype']}."]
    lines += [f"Python {e['python']}, {versions}.", ""]
    if report["quick"]:
        lines += ["**Quick sizes: these numbers mean nothing.**", ""]
    for entry in report["workloads"]:
        lines += [f"{'#' * level} {entry['name']}", "", *entry["method"].strip().splitlines(), ""]
        if "earlier" in entry:
            own = entry["earlier"]
            when = f"{own['date']}, commit {own['commit']}, load {own['load']} at the start"
            lines += [f"Measured in an earlier run: {when}.", ""]
        if entry["status"] != "ok":
            lines += [f"*{entry['status'].capitalize()}: {entry['reason']}*", ""]
        for table in entry["tables"]:
            lines += [f"**{table['title']}**", "", *_table(table["header"], table["rows"])]
            lines += [table["note"], ""] if table["note"] else []
        if "figure" in entry:
            lines += [f"![{entry['name']}]({entry['figure']})", ""]
        if entry["metrics"]:
            rows = _rows(entry["metrics"])
            if metrics:
                header = ("metric", "value", "better", "allowed change", "batch", "dtype")
                lines += _table(header, rows)
            elif not entry["tables"]:
                lines += _table(("metric", "value"), [row[:2] for row in rows])
    return "\n".join(lines)


def _rows(metrics: list[dict]) -> list[tuple[str, ...]]:
    """One row per metric; median, p95 and max of the same thing share one."""
    found = {m["key"]: m for m in metrics}
    rows = []
    for m in metrics:
        stem, _, statistic = m["key"].rpartition(".")
        spread = [found.get(f"{stem}.{name}") for name in SPREAD]
        if statistic in SPREAD[1:] and all(spread):
            continue
        together = spread if statistic == SPREAD[0] and all(spread) else [m]
        name = f"`{stem}` {' / '.join(SPREAD)}" if len(together) > 1 else f"`{m['key']}`"
        values = " / ".join(_value(one["value"], one["unit"]) for one in together)
        allowed = " / ".join(_allowed(one) for one in together)
        rows.append((name, values, m["better"], allowed, str(m["batch"] or ""), m["dtype"]))
    return rows


def _allowed(m: dict) -> str:
    parts = [f"{100 * m['rel_tol']:g} %"] if m["rel_tol"] else []
    parts += (
        [f"{m['abs_tol']:g} {'' if m['unit'] == '1' else m['unit']}".strip()]
        if m["abs_tol"]
        else []
    )
    return " + ".join(parts) or "none"


def _value(value: float, unit: str) -> str:
    if unit == "s" and value < 1:
        return f"{1e3 * value:.3g} ms"
    if unit == "count":
        return f"{value:,.0f}"
    shown = f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.4g}"
    return shown if unit == "1" else f"{shown} {unit}"


def _table(header, rows) -> list[str]:
    def line(cells):
        return "| " + " | ".join(str(c).replace("|", "\\|") for c in cells) + " |"

    return [line(header), line(["---"] * len(header)), *(line(row) for row in rows), ""]
