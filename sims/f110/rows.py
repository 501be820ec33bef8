"""Results of the study of few runs, as numbers, as a table, and in words."""

from typing import NamedTuple

from parc_jax.common.spelling import rounded_down, rounded_up
from parc_jax.learning.bound.counts import clopper_pearson

REPEATS, MANY = 10, 1000


class Row(NamedTuple):
    """One laboratory with `runs` runs, one claim.

    claim: "published", "honest" or "honest, strict". fitted: "network" or "affine". eps: None =
        nothing is claimed.
    discarded: runs of the holdout left outside the tube, and paid for. final_error: half widths of
    the tube at the end [m, m, rad], median over K. why: in words, when there is no plan; then the
    rest is empty.
    safe: share of the plans whose first point ends in the goal's box that is safe. share_of_k: of
    K, certified, at least, with 99.9 % confidence.
    promise: probability that a run of a random safe plan leaves the tube, at most. plan: start [m]
    and k.
    failed_10, failed_1000: repeats of that plan that missed the goal or touched a car;
    touched_1000: touched; left_1000: left the tube. failed_random, left_random: the same of 1,000
        runs of random safe plans. body: of the car, as of `problem`.
    """

    runs: int
    claim: str
    fitted: str
    eps: float | None
    discarded: int
    final_error: tuple[float, ...]
    why: str = ""
    safe: float = 0.0
    share_of_k: float = 0.0
    promise: float | None = None
    plan: tuple[float, ...] | None = None
    failed_10: int = 0
    failed_1000: int = 0
    touched_1000: int = 0
    left_1000: int = 0
    failed_random: int = 0
    left_random: int = 0
    body: str = "disc"


def interval(failed: int, n: int) -> tuple[float, float]:
    """Two-sided 95 % Clopper-Pearson interval of a failure probability."""
    return 1 - float(clopper_pearson(n - failed, n, 0.025)), float(
        clopper_pearson(failed, n, 0.025)
    )


def sentence(row: Row) -> str:
    """A row in words."""
    if row.eps is None:
        said = (
            f"{row.runs:,} runs, as published: a tube that held these is ASSUMED to hold all; "
            "nothing backs that"
        )
    else:
        said = (
            f"{row.runs:,} runs, {row.claim}: the {row.runs - row.runs // 2:,} runs kept apart "
            "show, with at least 95 % confidence, that no more than one new run in "
            f"{rounded_down(1 / row.eps, 3)} (eps = {rounded_up(row.eps, 4)}) leaves the tube"
        )
    if row.plan is None:
        return f"{said}. Under that tube: {row.why}"
    low, high = interval(row.failed_1000, MANY)
    return (
        f"{said}. One safe plan, driven {REPEATS} times, failed {row.failed_10} times; driven "
        f"{MANY:,} times, it "
        f"failed {row.failed_1000} times (so {rounded_down(100 * low, 3)} to "
        f"{rounded_up(100 * high, 3)} % of the time, with 95 % confidence) and left the tube "
        f"{row.left_1000} times. Of {MANY:,} runs of random safe plans {row.failed_random} failed "
        "and "
        f"{row.left_random} left the tube."
    )


def table(rows: list[Row]) -> list[str]:
    """Lines of plain text; the last one says with which confidence numbers hold."""
    lines = [
        f"{'runs':>6}  {'body':9}  {'claim':14}  {'fit':7}  {'eps':>7}  {'tube at the end':21}  "
        f"{'safe':>6}  {'of 10':>5}  "
        f"{'of 1,000 failed (95 %)':>22}  {'left tube':>9}  {'random plans':>12}  "
        f"{'left tube':>9}  {'promised':>8}"
    ]
    for r in rows:
        x, y, heading = r.final_error
        eps = "none" if r.eps is None else f"{rounded_up(r.eps, 4)}"
        width = f"±{x:.2f} ±{y:.2f} m ±{heading:.2f}"
        line = f"{r.runs:6,}  {r.body:9}  {r.claim:14}  {r.fitted:7}  {eps:>7}  {width:21}"
        if r.plan is None:
            lines.append(f"{line}  {'none':>6}  no safe plan found")
            continue
        low, high = interval(r.failed_1000, MANY)
        failed = f"{r.failed_1000} ({rounded_down(100 * low, 3)}..{rounded_up(100 * high, 3)} %)"
        promised = "-" if r.promise is None else f"{rounded_up(r.promise, 3)}"
        lines.append(
            f"{line}  {100 * r.safe:5.1f}%  {r.failed_10:5}  {failed:>22}  {r.left_1000:9}  "
            f"{r.failed_random:12}  "
            f"{r.left_random:9}  {promised:>8}"
        )
    return [
        *lines,
        "eps holds with at least 95 % confidence, promised with at least 93.9 %, since it rests on "
        "a volume and a coverage that were measured, too; of a published claim none is known.",
    ]
