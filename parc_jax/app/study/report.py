"""What a study shows: the one honest table that it prints, and its pictures."""

from pathlib import Path

from parc_jax.app.study.job import Studied
from parc_jax.app.study.numbers import eps_of, spread, table_of
from parc_jax.app.study.replay import Replay
from parc_jax.app.study.settings import Study
from parc_jax.common.spelling import rounded_down, rounded_up


def report(outcome: Studied) -> str:
    """Plain text for a terminal: stages, comparison, answer, replay, statement."""
    m = outcome.metrics
    lines = [
        "",
        f"{m['system']}: {m['regions']} regions; seed {m['seed']}; jax {m['jax']} on {m['device']}",
        "",
    ]
    lines += _table(
        ("stage", "seconds", "of it compiling"),
        [
            (name, f"{s['seconds']:.1f}", f"{s['compile_seconds']:.1f}")
            for name, s in m["stages"].items()
        ],
    )
    if m["comparison"]:
        lines += [
            "",
            "Networks and claims (error at the end: median over K; safe: share of all (p0, k) "
            "whose first point",
            "ends in the goal's box, and of those that end in the goal shrunken by the error)",
        ]
        rows = []
        for row in m["comparison"]:
            kind = _claim_name(row)
            shown = ("none", "")
            if row["safe"]:
                kept = row["safe"] / row["reaching"]  # what obstacles leave of what the tube leaves
                shown = (f"{100 * row['safe']:.1f} %", f"{100 * kept:.1f} %")
            error = spread(row["final_error"], outcome.answer.model)
            rows.append((row["network"], str(row["regions"]), kind, error, *shown))
        lines += _table(
            ("network", "regions", "claim", "error at the end", "safe", "of reaching"), rows
        )
    lines += ["", *table_of(outcome.answer, m["first_sample_cold_s"])]
    if m["replay"] is not None:
        lines += _replayed(m["replay"], eps_of(outcome.answer.model.claim))
    driven = [] if m.get("driven") is None else [m["driven"]["statement"]]
    return "\n".join([*lines, "", outcome.answer.statement(), *driven, ""])


def _claim_name(row: dict) -> str:
    if row["claim"] == "assumed":
        return "ASSUMED (published kind)"
    where = " in every bin" if row["by_bin"] else ""
    without = f", {row['unclaimed_bins']} bins without" if row["unclaimed_bins"] else ""
    return f"honest{where}, eps = {row['eps']}{without}"


def _replayed(r: dict, eps: str | None) -> list[str]:
    often = "" if r["repeats"] == 1 else f", {r['repeats']} runs each"
    claim = "nothing is shown of the tube" if eps is None else f"claim: eps = {eps}"
    lines = [
        f"replay                 {r['plans']} plans{often} in the simulator: {r['reached']} "
        f"reached, {r['touched']} touched, {r['left_tube']} left the tube ({claim})"
    ]
    if r["repeats"] > 1:
        blank = " " * 23
        mean, every = (rounded_up(r[n]) for n in ("failure_mean_at_most", "every_plan_at_most"))
        lines += [
            f"{blank}{r['failed']} of {r['runs']} runs failed: with confidence "
            f"{rounded_down(str(r['confidence']), 10)}, a run of one of "
            f"these plans, drawn at random,",
            f"{blank}fails with probability at most {mean}; no plan of them with more than "
            f"{every} (worst: {r['worst_plan_failed']} of {r['repeats']})",
        ]
    return lines


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[str]:
    widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head))]
    return [
        "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip()
        for row in [head, tuple("-" * w for w in widths), *rows]
    ]


def figures(outcome: Studied, study: Study, out: Path) -> list[Path]:
    """Draw everything that this outcome supports; returns the files."""
    from parc_jax.app.plot.errors import Entry, errors
    from parc_jax.app.plot.regions import region_seconds, regions
    from parc_jax.app.plot.samples import samples
    from parc_jax.app.plot.spread import spread as spread_of_runs
    from parc_jax.neuralparc.verdicts import region_verdicts

    answer = outcome.answer
    drawn = []
    if answer.found:
        drawn.append(out / "samples.png")
        runs = outcome.runs
        first = None if runs is None else Replay(*(part[:: study.repeats] for part in runs))
        samples(answer, first, drawn[-1])
        if runs is not None and study.repeats > 1:
            drawn.append(out / "spread.png")
            spread_of_runs(answer, runs, study.repeats, drawn[-1])
    if answer.uncertainty is None and 2 <= answer.model.n_k <= 3:
        drawn.append(out / "regions.png")
        verdicts = region_verdicts(answer, outcome.table)
        when = region_seconds(answer, outcome.table) if answer.polytopes else None
        regions(outcome.table, verdicts, when, drawn[-1], names=answer.model.labels.k)
    if outcome.learned is not None:
        drawn.append(out / "errors.png")
        entries = [Entry(m.name, m.assumed.claim, m.honest.claim) for m in outcome.learned.networks]
        errors(entries, answer.model.time, drawn[-1])
    return drawn
