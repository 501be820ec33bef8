"""The Markdown page: method first, then the results of every platform in the baseline."""

SPREAD = ("median", "p95", "max")
HEAD = """# Benchmarks

How fast each step is, how much of the truly safe set is certified, and the comparison with the published method. This page is
written by `python -m benchmarks --update-baseline`; do not edit it.

```
python -m benchmarks                        # everything, about forty minutes on two quiet cores
python -m benchmarks --only points bras     # some workloads, with every metric
python -m benchmarks --quick                # tiny sizes: does everything work? Its numbers mean nothing
python -m benchmarks --gate                 # exit code 1 if anything is worse than the committed baseline
python -m benchmarks --update-baseline      # accept the results of this run: baseline.json and this page
python -m benchmarks --device gpu --json results.json
```

## Method

* Every metric has unit, direction and tolerance, and is gated: counts and verdicts tightly, on every machine; times
  loosely, and only against a baseline from the same kind of machine.
* Compile, cold and warm are apart. A time ends when the *result* is there. Warm times are medians, over at least 100
  seeds where a query is random.
* Methods that are compared run side by side: same process, machine, model, scene and float64. Verdicts are float64
  with a margin that covers rounding; training is float32.
* Figures of the paper are its authors', for their networks on their machine. They are marked and never gated.
* Here are the results that a reader can use without the code. All metrics and whole tables are in
  `benchmarks/baseline.json`; how a workload measures is the docstring of its file in `benchmarks/workloads`.
* Other programs on the same network: [peers](suite.md#peers).
"""
HEADLINES = {  # metric: what it is, for people; in the order of the page
    "main_job.median": "`parc-jax run drift_parking`, from nothing to its end",
    "main_job.first_picture.median": "its first picture of proved plans",
    "cold_start.filled_cache.median": "from `python` to a proved plan of a saved model",
    "cold_start.shell.filled_cache.median": "the same by `parc-jax solve drift_parking --first`",
    "query.first_sample.median": "a safe plan, model in memory, scene laid out anew",
    "query.prepared.median": "a safe plan of a scene that is laid out",
    "query.prepared_proved.median": "the same with its exact proof",
    "query.corridors_cover.median": "corridors that cover 99 % of the safe set",
    "batch_query.4096.rate": "random scenes, each to its first safe plan",
    "points.rate": "verdicts on single (p0, k)",
    "lps.batched": "small linear programs, checked",
    "checking.program.median": "`parc-jax check` of 100 samples and the safe polytopes",
    "onboard.call": "the C header: is this plan safe?",
}
SHOWN = {  # workload: rows of its tables that the page shows
    "main_job": None,
    "practice": None,
    "table_one": lambda rows: [row for row in rows if row[1] == "4x8"],
    "bras": None,
    "gap": lambda rows: rows[::2] if len(rows) > 8 else rows,
    "yield": lambda rows: _ends(rows, 2),
    "rollouts": lambda rows: [row for row in rows if row[2] not in ("1", "2,048")],
    "rare": lambda rows: _ends(rows, 0),
    "clutter": lambda rows: _ends([row for row in rows if row[0] in ("plain", "moving")], 1),
    "scaling": lambda rows: [],  # its figure says it
    "fails_safely": None,
}
EXPLAINED = {  # what a reader of the tables needs beside the first sentence of the method
    "table_one": "LPs as published: timed on a random tenth of the regions and scaled up. Of the safe set: the part of\n"
    "the (p0, k) that are safe for the model inside the same tube that the method keeps.",
    "practice": "From each of 100 starts some manoeuvre parks. Sampling has the learned network as its nominal model,\n"
    "and all of its rounds before the manoeuvre begins, in which a car that drifts cannot be planned anew.",
    "bras": "LPs are timed on a random tenth of the regions and scaled up; lean: the same programs, the solver with\n"
    "nothing around it.",
    "gap": "Slack is the room left between body and obstacles; the circle is the one around the car.",
    "yield": "A plan truly succeeds when the goal is reached and nothing is touched in 99 % of its runs: of 200 (boat), of\n"
    "100 (car), in its one run without chance (drift). In brackets: intervals at 95 %; that of a yield joins two of them,\n"
    "which both hold at 90 %. All settings of a system have equal eps, delta and numbers of runs.",
    "clutter": "Processor time for sixteen plans. Prepared: the scene is laid out once. New scene: laid out anew each time.\n"
    "Programs: what the first scene of so many obstacles compiles.",
}


def _ends(rows: list, n: int) -> list:
    """First and last of the rows that agree in the first n cells."""
    groups: dict[tuple, list] = {}
    for row in rows:
        groups.setdefault(tuple(row[:n]), []).append(row)
    return [row for group in groups.values() for row in (group[:1] + group[1:][-1:])]


def page(baselines: dict[str, dict]) -> str:
    """The whole page from the reports of all platforms."""
    parts = [HEAD]
    if not baselines:
        parts.append("None recorded yet.\n")
    for platform, report in sorted(baselines.items()):
        parts.append("\n".join(_of_platform(report, platform)))
    return "\n".join(parts)


def _of_platform(report: dict, platform: str) -> list[str]:
    entries = {entry["name"]: entry for entry in report["workloads"]}
    lines = [f"## On {platform.upper()}", "", *_where(report["environment"])]
    earlier: dict[tuple[str, str], list[str]] = {}
    for name, entry in entries.items():
        if own := entry.get("earlier"):
            earlier.setdefault((own["date"], own["commit"]), []).append(name)
    for (date, commit), names in earlier.items():
        which = f"{len(names)} of {len(entries)} workloads"
        which = which if len(names) > 3 else ", ".join(names)
        lines += [f"Measured in an earlier run ({date}, commit {commit}): {which}.", ""]
    found = {m["key"]: m for entry in entries.values() for m in entry["metrics"]}
    rows = [
        (said, _value(found[key]["value"], found[key]["unit"]), f"`{key.split('.')[0]}`")
        for key, said in HEADLINES.items()
        if key in found
    ]
    lines += _table(("", "median", "workload"), rows) if rows else []
    for name, choose in SHOWN.items():
        if name not in entries:
            continue
        entry = entries.pop(name)
        lines += [f"### {name}", "", *_first_paragraph(entry["method"])]
        lines += [*EXPLAINED.get(name, "").splitlines(), ""]
        if entry["status"] != "ok":
            lines += [f"*{entry['status'].capitalize()}: {entry['reason']}*", ""]
        for table in entry["tables"]:
            rows = choose(table["rows"]) if choose else table["rows"]
            if rows:
                lines += [f"**{table['title']}**", "", *_table(table["header"], rows)]
                lines += [table["note"], ""] if table["note"] else []
        if "figure" in entry:
            lines += [f"![{name}]({entry['figure']})", ""]
    lines += ["### In baseline.json alone", ""] if entries else []
    for name, entry in entries.items():
        failed = "" if entry["status"] == "ok" else f" *{entry['status'].capitalize()}.*"
        said = " ".join(line.strip() for line in _first_paragraph(entry["method"]))
        lines += [f'* <a id="{name}"></a>`{name}`: {said}{failed}']
    return [*lines, ""] if entries else lines


def _first_paragraph(text: str) -> list[str]:
    return text.strip().split("\n\n")[0].splitlines()


def _where(e: dict) -> list[str]:
    versions = ", ".join(f"{name} {version}" for name, version in e["versions"].items())
    where = (
        f"{e['device']}, {e['devices']} device(s), {e['processors']} processors, load "
        f"{e['load']} at the start"
    )
    return [
        f"{where}; {e['date']}; commit {e['commit']}; {e['dtype']}.",
        f"Python {e['python']}, {versions}.",
        "",
    ]


def results(report: dict, title: str, level: int) -> str:
    """One report as Markdown, with every metric and what the gate allows it.

    level: of the headings of its workloads.
    """
    lines = [title, "", *_where(report["environment"])]
    if report["quick"]:
        lines += ["**Quick sizes: these numbers mean nothing.**", ""]
    for entry in report["workloads"]:
        lines += [f"{'#' * level} {entry['name']}", "", *entry["method"].strip().splitlines(), ""]
        if entry["status"] != "ok":
            lines += [f"*{entry['status'].capitalize()}: {entry['reason']}*", ""]
        for table in entry["tables"]:
            lines += [f"**{table['title']}**", "", *_table(table["header"], table["rows"])]
            lines += [table["note"], ""] if table["note"] else []
        if entry["metrics"]:
            header = ("metric", "value", "better", "allowed change", "batch", "dtype")
            lines += _table(header, _rows(entry["metrics"]))
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
    if unit == "s" and value < 1e-4:
        return f"{1e6 * value:.3g} µs"
    if unit == "s" and value < 1:
        return f"{1e3 * value:.3g} ms"
    if unit == "count":
        return f"{value:,.0f}"
    shown = f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.4g}"
    return shown if unit == "1" else f"{shown} {unit}"


def _table(header, rows) -> list[str]:
    def line(cells):
        return "| " + " | ".join(str(c).replace("|", "\\|") for c in cells) + " |"

    return [line(header), "|" + "---|" * len(header), *(line(row) for row in rows), ""]
