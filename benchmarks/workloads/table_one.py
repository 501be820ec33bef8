"""Table I of the paper in one run, with the columns it does not have. Drift parking and the boat,
learned in this run.

Rows of one network share one trajectory network and one scene. "assumed" tube: the published
statistic, largest training error, one bin. Otherwise the tube is claimed from fresh rollouts at the
stated eps, over bins of K; all claims hold at once. PARC is one affine map, through the published
method. "LPs as published": BRAS timed on a random tenth of the regions and scaled up; the anytime
search starts from a random region per seed, 50 samples per region, and is cut off after a few
seconds (then "none in time"). LP-free: the same sets through support functions. Ours: the planner,
which needs no regions for a sample. Share of the safe set: of the (p0, k) that are safe for the
model inside the same tube, the part that the method keeps (published: not in any avoid set; ours:
inside returned corridors, lower bound with confidence 99 %, after at most 8 s). The paper's figures
stand beside ours as its authors measured them on their machine, for their networks.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import Metric, exact, metric, ratio, times
from benchmarks.models import PARC, CaseModels, name_of
from benchmarks.neuralparc.cells import Cell, cells_outward
from benchmarks.neuralparc.scene import paper_scene
from benchmarks.neuralparc.search import paper_search
from benchmarks.published import Partition, kept
from benchmarks.result import Result, Skip, Table, milliseconds, percent
from benchmarks.workloads.bras import Comparison, compare
from parc_jax.common.errors import InputError
from parc_jax.common.status import Status
from parc_jax.learning.model import TrajectoryModel
from parc_jax.planner import Planner
from parc_jax.problem.problem import Problem
from parc_jax.proof.regions import RegionTable, enumerate_regions
from parc_jax.safe_set.corridors.sampling import draw
from parc_jax.safe_set.settings import Settings
from parc_jax.safe_set.verdict.scene import scene_of

HEADER = (
    "method",
    "network",
    "tube",
    "regions",
    "BRAS",
    "first sample min / mean / max",
    "found",
    "of the safe set",
    "proof",
)


@dataclass(frozen=True)
class Search:
    """First samples over seeds: times [s] of those that found one, how many seeds there were, and
    whether the others saw everything there is before the time was up."""

    seconds: np.ndarray
    seeds: int
    exhausted: bool = False

    @property
    def text(self) -> tuple[str, str]:
        """Two cells: min / mean / max, and found of seeds."""
        s, spread = self.seconds, "none" if self.exhausted else "none in time"
        if len(s):
            spread = " / ".join(milliseconds(x) for x in (s.min(), s.mean(), s.max()))
        return spread, f"{len(s)} of {self.seeds}"


def run(bench: Bench) -> Result:
    """Every case that can be learned here."""
    metrics, tables, skipped = [], [], []
    for name in bench.size(("drift", "boat"), ("boat",)):
        try:
            learned = bench.learned(name)
        except Skip as why:
            skipped.append(f"{name}: {why}")
            continue
        rows: list[tuple[str, ...]] = []
        for widths in (PARC, *(h for h in learned.case.hidden if h in learned.models)):
            key = f"table_one.{name}.{name_of(widths)}"
            more, lines = _network(bench, learned, widths, key)
            metrics, rows = metrics + more, rows + lines
        tables.append(
            Table(f"Table I, {name}", HEADER, rows, f"Claimed tubes: eps = {learned.eps:g}.")
        )
    if not tables:
        raise Skip("; ".join(skipped))
    return Result(metrics, tables)


def _network(
    bench: Bench, learned: CaseModels, widths, key: str
) -> tuple[list[Metric], list[tuple[str, ...]]]:
    """All rows of one network."""
    claims, problem, label = learned.models[widths], learned.case.problem(), name_of(widths)
    table = enumerate_regions(claims.assumed.net, claims.assumed.domain)
    who = "PARC" if widths == PARC else "NeuralPARC"
    rows, metrics = [], [metric(f"{key}.regions", table.count, "count", "lower", rel_tol=0.3)]
    if widths in learned.case.published:
        regions, seconds = learned.case.published[widths]
        rows.append(
            (
                "NeuralPARC, paper's own figure",
                label,
                "assumed",
                str(regions),
                f"{seconds:g} s",
                *[""] * 4,
            )
        )
    try:
        both = compare(claims.assumed, problem, bench)
        share = published_share(bench, claims.assumed, problem, table)
        search = search_published(bench, claims.assumed, problem, table)
    except InputError as why:
        rows.append(
            (
                f"{who}, LPs as published",
                label,
                "assumed",
                str(table.count),
                "",
                "no plan",
                "",
                "",
                str(why),
            )
        )
    else:
        metrics += _published_metrics(key, both, share)
        with_lps = (
            f"{both.lp_s:.3g} s ± {milliseconds(both.lp_error_s)} ({both.measured} of "
            f"{both.regions} timed)"
        )
        same = label, "assumed", str(table.count)
        free = milliseconds(np.median(both.free_s))
        rows.append(
            (f"{who}, LPs as published", *same, with_lps, *search.text, percent(share), "none")
        )
        rows.append((f"{who}, LP-free", *same, free, "", "", percent(share), "none"))
    for tube, model in (("assumed", claims.assumed), (f"eps = {learned.eps:g}", claims.honest)):
        more, line = _ours(bench, model, problem, f"{key}.ours.{tube.split()[0]}")
        metrics += more
        rows.append(("ours", label, tube, str(table.count), "not needed", *line))
    return metrics, rows


def _published_metrics(key: str, both: Comparison, share: float) -> list[Metric]:
    return [
        *times(f"{key}.lp_free", both.free_s),
        metric(f"{key}.lp", both.lp_s, "s", "lower", rel_tol=1.0),
        ratio(f"{key}.ratio", both.lp_s, float(np.median(both.free_s))),
        metric(f"{key}.lean_lp", both.lean_s, "s", "lower", rel_tol=1.0),
        ratio(f"{key}.lean_ratio", both.lean_s, float(np.median(both.free_s))),
        metric(f"{key}.published_share", share, "1", "same", abs_tol=0.2),
    ]


def _ours(
    bench: Bench, model: TrajectoryModel, problem: Problem, key: str
) -> tuple[list[Metric], tuple[str, ...]]:
    """Metrics and the last four cells of a row of ours."""
    try:
        search = search_ours(bench, model, problem)
        if not len(search.seconds):
            return [metric(f"{key}.found", 0, "count", "higher")], (*search.text, "", "")
        options = {
            "samples": bench.size(100, 3),
            "target": bench.size(0.01, 0.5),
            "work": bench.size(1.0, 0.05),
        }
        answer = Planner(model).solve(problem, bench.key(), Settings(**options))
    except InputError as why:
        return [], ("no plan", "", "", str(why))
    level = "every sample and corridor" if answer.status is Status.PROVED else answer.status.label
    share = answer.coverage.at_least
    metrics = [
        *times(f"{key}.first_sample", search.seconds),
        metric(f"{key}.found", len(search.seconds), "count", "higher"),
        metric(f"{key}.covered", share, "1", "higher", abs_tol=0.02),
        exact(f"{key}.refused_by_checker", answer.cover.refused),
    ]
    return metrics, (*search.text, f"at least {percent(share)}", level)


def search_ours(bench: Bench, model: TrajectoryModel, problem: Problem) -> Search:
    """Time to the first safe sample over seeds, scene laid out anew each time. Warm."""
    seconds, seeds = [], bench.size(100, 2)
    for seed in range(-1, seeds):  # the first one compiles
        begin, rng = time.perf_counter(), np.random.default_rng(seed + 1)
        scene, found = scene_of(problem, model), 0
        while not found and time.perf_counter() - begin < bench.size(2.0, 0.5):
            found = len(draw(scene, rng, 512).safe.k)
        if found and seed >= 0:
            seconds.append(time.perf_counter() - begin)
        if not found and seed == 4 and not seconds:  # hopeless: do not wait for the others
            return Search(np.zeros(0), seed + 1)
    return Search(np.array(seconds), seeds)


def search_published(
    bench: Bench, model: TrajectoryModel, problem: Problem, table: RegionTable
) -> Search:
    """Time to the first safe sample of the anytime search with LPs, from random regions."""
    scene, seconds, seeds, exhausted = (
        paper_scene(problem, model.tube),
        [],
        bench.size(5, 1),
        True,
    )
    rng, most = np.random.default_rng(0), bench.size(4.0, 0.5)
    for seed in range(-1, seeds):
        first = rng.uniform(model.domain.lo, model.domain.hi)
        begin = time.perf_counter()
        regions = _until(begin + most, cells_outward(table, model.tube, first))
        if seed < 0:  # warm-up: the sampler compiles
            regions = islice(regions, 1)
        found = paper_search(bench.key(seed + 1), regions, scene, method="lp", anytime=True)
        if seed >= 0 and len(found.samples):
            seconds.append(time.perf_counter() - begin)
        elif seed >= 0:
            exhausted &= found.tally.regions == table.count
    return Search(np.array(seconds), seeds, exhausted)


def _until(end: float, regions: Iterator[list[Cell]]) -> Iterator[list[Cell]]:
    """Regions until the clock says `end`."""
    for region in regions:
        if time.perf_counter() > end:
            return
        yield region


def published_share(
    bench: Bench, model: TrajectoryModel, problem: Problem, table: RegionTable
) -> float:
    """Share of the model's safe set, by volume, that the published avoid sets keep. 0 if nothing is
    safe.
    """
    found = draw(
        scene_of(problem, model), np.random.default_rng(0), bench.size(1 << 15, 1 << 9)
    ).safe
    return (
        float(kept(Partition(model, table), problem, found.p0, found.k, found.bin).mean())
        if len(found.k)
        else 0.0
    )
