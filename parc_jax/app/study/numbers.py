"""Numbers for people, and facts for other programs."""

import numpy as np

from parc_jax.answer.answer import Answer
from parc_jax.common.spelling import rounded_up
from parc_jax.learning.bound.claim import ErrorClaim
from parc_jax.learning.labels import name_of, unit_of
from parc_jax.learning.model import TrajectoryModel
from parc_jax.statement import about_coverage, about_share


def eps_of(claim: ErrorClaim) -> str | None:
    """The eps that a claim says, for people, by bin the largest; None where nothing is shown."""
    known = [claim.eps, *(claim.bin_eps or ())]
    known = [eps for eps in known if eps is not None]
    return rounded_up(max(known)) if known else None


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
    said = ", ".join(
        f"±{v:{digits}} {unit_of(n)} {name_of(n)}".replace("  ", " ") for v, n in parts
    )
    return said if model.n_points == 1 else f"{said}, at the widest of {model.n_points} points"
