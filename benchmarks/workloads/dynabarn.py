"""Worlds of DynaBARN, as many of each kind, in which a Jackal crosses a crowd of known places.

As `python -m sims.dynabarn` drives them: proved for as long as it can be, else told as not proved.
While a claim is in force nobody whom it is about may be touched. Steps are told in processor time.
Once more with movers that the lidar sees, for which scans and tracks are part of a step.
"""

import numpy as np

from benchmarks.bench import Bench
from benchmarks.metrics import LOOSE, exact, metric
from benchmarks.result import Result, Table, milliseconds

EACH = 3  # worlds of a kind
PHASE = 2  # from the first one on no hard world of these is crossed, so none could be lost


def run(bench: Bench) -> Result:
    """Drive them one after the other."""
    from sims.dynabarn.__main__ import episode
    from sims.dynabarn.worlds import KINDS, numbers, world

    each = bench.size(EACH, 1)
    metrics, rows = [], []
    cases = [(kind, False) for kind in bench.size(tuple(KINDS), ("easy",))]
    cases.append((bench.size("medium", "easy"), True))
    for kind, lidar in cases:
        ours = [number for number in numbers() if world(number).kind == kind][:each]
        told = [episode("loop", number, PHASE, lidar) for number in ours]
        reached, left = (sum(one[name] for one in told) for name in ("reached", "left"))
        contradicted = sum(one["cause"] == "CONTRADICTED" for one in told)
        step = np.median([one["plan_ms"][0] for one in told]) / 1e3
        name = f"dynabarn.{kind}" + ".lidar" * lidar
        metrics += [
            metric(f"{name}.reached", reached, "count", "higher", abs_tol=1),
            exact(f"{name}.contradicted", contradicted),
            exact(f"{name}.left", left),
            metric(f"{name}.step", step, "s", "lower", rel_tol=LOOSE),
        ]
        seen = f"{kind}, seen by the lidar" if lidar else kind
        rows.append((seen, f"{reached} of {len(told)}", milliseconds(step)))
    header = ("worlds", "reached, nobody touched", "processor time of a step, median")
    return Result(metrics, [Table("A Jackal in a crowd", header, rows)])
