"""Scores as a table, and as a figure."""

from collections import defaultdict

import numpy as np

STATUSES = ("stands", "right", "empty", "open", "unknown", "invalid", "refuted")
HEADER = (
    "entry",
    "instances",
    "points",
    "stand",
    "right none",
    "no answer",
    "**refuted**",
    "yield where plans are, mean",
    "of those that stand",
    "of it certified",
    "runs, median",
    "first plan of those that stand, median [s]",
    "in all, median [s]",
)


def table(report: dict) -> str:
    """The entries of a report in Markdown, most points first. The yield of a scene that has plans,
    and no answer that stands, is 0.
    """
    rows = sorted(_rows(report), key=lambda row: -row[2])
    lines = [HEADER, ["---"] * len(HEADER), *rows]
    return "\n".join("| " + " | ".join(map(_spelled, line)) + " |" for line in lines)


def by_entry(report: dict) -> dict[str, dict[str, dict]]:
    """Entry -> instance -> what came of it."""
    found: dict[str, dict[str, dict]] = defaultdict(dict)
    for name, one in report["instances"].items():
        for entry, result in one["entries"].items():
            found[entry][name] = result
    return dict(found)


def _rows(report: dict):
    planned = [name for name, one in report["instances"].items() if one["truth"]["good"]]
    for entry, results in by_entry(report).items():
        each = list(results.values())
        count = {status: sum(r["status"] == status for r in each) for status in STATUSES}
        nothing = sum(count[status] for status in ("empty", "open", "unknown", "invalid"))
        with_plans = [results[name] for name in planned if name in results]
        yields = [r["yield"][0] for r in with_plans if "yield" in r]
        missing = [0.0] * (len(with_plans) - len(yields))
        stand = [r for r in each if r["status"] == "stands" and r.get("first_s") is not None]
        first = [r["first_s"] + r["prepare_s"] for r in stand]
        yield (
            entry,
            len(each),
            round(sum(r["points"] for r in each), 1),
            count["stands"],
            count["right"],
            nothing,
            count["refuted"],
            _mean(yields + missing),
            _mean(yields),
            _certified(each),
            int(np.median([r["rollouts"] for r in each])),
            round(float(np.median(first)), 1) if first else "",
            round(float(np.median([r["prepare_s"] + r["answer_s"] for r in each])), 1),
        )


def _mean(yields: list[float]) -> str:
    return f"{100 * np.mean(yields):.0f} %" if yields else ""


def _certified(results: list[dict]) -> str:
    """Of the plans that answers hold, the share that a proof bears out which the checker took."""
    held = [r["yield"][0] for r in results if "yield" in r]
    share = [r.get("certified") or 0.0 for r in results if "yield" in r]
    return f"{100 * np.dot(held, share) / sum(held):.0f} %" if sum(held) and any(share) else ""


def _spelled(value) -> str:
    return f"{value:,}" if isinstance(value, int | float) else str(value)


def figure(report: dict, path) -> None:
    """Points of every entry on every instance, with their sums, to a file; red is refuted."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    entries = by_entry(report)
    names = sorted(entries, key=lambda e: -sum(r["points"] for r in entries[e].values()))
    ids = list(report["instances"])
    points = np.full((len(names), len(ids)), np.nan)
    for i, name in enumerate(names):
        for j, one in enumerate(ids):
            points[i, j] = entries[name].get(one, {"points": np.nan})["points"]
    drawn, axes = plt.subplots(figsize=(2 + 0.34 * len(ids), 1.6 + 0.35 * len(names)))
    colours = plt.get_cmap("YlGn").with_extremes(under="firebrick", bad="white")
    shown = axes.imshow(points, cmap=colours, vmin=0.0, vmax=10.0, aspect="auto")
    axes.set_xticks(range(len(ids)), ids, rotation=90, fontsize=7)
    sums = np.nansum(points, axis=1)
    told = [f"{name}  {total:,.0f}" for name, total in zip(names, sums, strict=True)]
    axes.set_yticks(range(len(names)), told, fontsize=8)
    for (i, j), value in np.ndenumerate(points):
        if abs(value) > 0:
            colour = "white" if value < 0 or value > 6 else "black"
            axes.text(j, i, f"{value:.3g}", ha="center", va="center", fontsize=6, color=colour)
    drawn.colorbar(shown, ax=axes, label="points; red: refuted, −150", extend="min", pad=0.01)
    drawn.savefig(path, dpi=120, bbox_inches="tight")
    plt.close(drawn)
