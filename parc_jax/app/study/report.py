"""The report of a study and of a query: tables for people, facts for other programs, pictures."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.app.study.replay import Replay
from parc_jax.app.study.settings import Study
from parc_jax.common.spelling import rounded_down, rounded_up
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.labels import name_of, unit_of
from parc_jax.learning.learn import Learned
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import ReLUNetwork
from parc_jax.proof.regions import RegionTable
from parc_jax.statement import about_coverage, about_share


class Studied(NamedTuple):
    """Everything a study produced. learned is None when the model came from a file.

    runs: of every returned plan, study.repeats each, grouped by plan; None when there is no plan.
    """

    answer: Answer
    runs: Replay | None
    table: RegionTable
    learned: Learned | None
    metrics: dict


def report(outcome: Studied) -> str:
    """Plain text for a terminal: stages, answer, replay, statement."""
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
    lines += ["", *table_of(outcome.answer, m["first_sample_cold_s"])]
    if m["replay"] is not None:
        lines += _replayed(m["replay"], eps_of(outcome.answer.model.claim))
    driven = [] if m.get("driven") is None else [m["driven"]["statement"]]
    return "\n".join([*lines, "", outcome.answer.details(), *driven, ""])


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
    from parc_jax.app.figures import region_verdicts
    from parc_jax.app.plot.errors import Entry, errors
    from parc_jax.app.plot.regions import regions
    from parc_jax.app.plot.samples import samples
    from parc_jax.app.plot.spread import spread as spread_of_runs
    from parc_jax.learning.bound.declared import assumed_claim

    answer = outcome.answer
    drawn = []
    if answer.status.found:
        drawn.append(out / "samples.png")
        runs = outcome.runs
        first = None if runs is None else Replay(*(part[:: study.repeats] for part in runs))
        samples(answer, first, drawn[-1])
        if runs is not None and study.repeats > 1:
            drawn.append(out / "spread.png")
            spread_of_runs(answer, runs, study.repeats, drawn[-1])
    if answer.scene.asked.doubt is None and 2 <= answer.model.n_k <= 3:
        drawn.append(out / "regions.png")
        verdicts = region_verdicts(answer, outcome.table)
        regions(outcome.table, verdicts, drawn[-1], names=answer.model.labels.k)
    if outcome.learned is not None:
        drawn.append(out / "errors.png")
        model, train = outcome.learned.model, outcome.learned.train
        bins = None if study.blocks is None else model.tube.edges
        assumed = assumed_claim(model.net, train, bins)
        errors([Entry(name_of_network(model.net), assumed, model.claim)], model.time, drawn[-1])
    return drawn


def eps_of(claim: ErrorClaim) -> str | None:
    """The eps that a claim says, for people, by bin the largest; None where nothing is shown."""
    levels = [claim.eps, *(claim.bin_eps or ())]
    levels = [eps for eps in levels if eps is not None]
    return rounded_up(max(levels)) if levels else None


def final_error(model: TrajectoryModel) -> np.ndarray:
    """Median half widths (n_c + n_q,) of the tube at the end, over the bins with a bound; infinite
    where there is none.
    """
    final = model.tube.final[model.tube.claimed]
    return np.median(final, axis=0) if len(final) else np.full(model.n_c + model.n_q, np.inf)


def name_of_network(net: ReLUNetwork) -> str:
    """The widths of its layers, or PARC for one affine map."""
    return "-".join(map(str, net.hidden)) or "PARC"


def seconds(value: float | None) -> str:
    """A time for people."""
    if value is None:
        return "-"
    return f"{value * 1e3:.0f} ms" if value < 1 else f"{value:.1f} s"


def facts_of(answer: Answer, cold_s: float | None) -> dict:
    """Counts, shares, status and times of an answer as plain data.

    cold_s: [s] to the first sample of a first query, compiling included; None where that is this
    answer.
    """
    cover, share = answer.cover, answer.share
    return {
        "counts": {"drawn": cover.drawn, "reaching": cover.reaching, "safe": cover.safe},
        "share": None if share is None else share._asdict(),
        "volume": None if share is None else share.volume,
        "corridors": len(answer.corridors),
        "coverage": answer.coverage._asdict(),
        "status": answer.status.label,
        "ended": None if cover.ended is None else cover.ended.label,
        "refused": cover.refused,
        "first_sample_cold_s": cover.timings["first_sample_s"] if cold_s is None else cold_s,
        "timings": cover.timings,
    }


def table_of(answer: Answer, cold_s: float | None) -> list[str]:
    """The table of a query, line by line. cold_s: as of `facts_of`."""
    cover, t = answer.cover, answer.cover.timings
    around = cover.within is not None
    times = [f"{seconds(t['first_sample_s'])} {'cold' if cold_s is None else 'warm'}"]
    if cold_s is not None:
        times = [f"{seconds(cold_s)} cold", *times]
    lines = [f"first safe sample      {', '.join(times)}"]
    if answer.corridors or not answer.status.found:
        # where one plan was requested and found, too few were drawn to say how many are safe
        here = answer.scene.at is not None
        share = about_share(answer.share, cover.safe, from_here=here, around=around)
        lines = [f"safe                   {share}", *lines]
    if answer.corridors:
        part = "the safe set" + (" around what a search found" if around else "")
        covered = about_coverage(answer.coverage, part)
        lines.append(f"corridors              {len(answer.corridors)}, {covered}")
        lines.append(f"safe set               in {seconds(t['cover_s'])}")
    proof = f"{answer.status}, {cover.refused} refused, in {seconds(t['proof_s'])}"
    return [*lines, f"proof                  {proof}"]


def spread(values: np.ndarray, model: TrajectoryModel, digits: str = ".2f") -> str:
    """Half widths (n_c + n_q,) at the end in words; per axis of the point where it is widest."""
    values = np.asarray(values)
    places = values[: model.n_c].reshape(model.n_points, model.n_p).max(axis=0)
    parts = zip([*places, *values[model.n_c :]], model.labels.goal, strict=True)
    words = ", ".join(
        f"±{v:{digits}} {unit_of(n)} {name_of(n)}".replace("  ", " ") for v, n in parts
    )
    return words if model.n_points == 1 else f"{words}, at the widest of {model.n_points} points"
