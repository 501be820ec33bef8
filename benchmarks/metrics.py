"""The metric contract: every number that is reported is a Metric, and every Metric is gated."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

BETTER = ("lower", "higher", "same")
# [1] allowed relative change of a median time: machines are shared and turbo comes and goes
LOOSE = 0.5


@dataclass(frozen=True)
class Metric:
    """One number with all that is needed to judge a change of it.

    key: "workload.what.statistic". unit: "s", "1/s", "x" (a ratio), "1" (a share), "count", or a
        length "m".
    better: "lower", "higher", or "same" for what must not change either way.
    rel_tol, abs_tol: allowed change for the worse, relative to the baseline and in units of the
        value; they add up.
    batch: items per call, 0 where there is none. dtype: of the arithmetic that was measured.
    """

    key: str
    value: float
    unit: str
    better: str
    rel_tol: float = 0.0
    abs_tol: float = 0.0
    batch: int = 0
    dtype: str = "float64"

    @property
    def tied_to_machine(self) -> bool:
        """Times and rates: compared only with a baseline of the same kind of machine."""
        return self.unit in ("s", "1/s")

    def to_json(self) -> dict:
        """Plain dictionary."""
        return asdict(self)


def metric(key: str, value, unit: str, better: str, **rest) -> Metric:
    """Validated metric. Raises ValueError."""
    value = float(value)
    if not np.isfinite(value):
        raise ValueError(
            f"metric {key}: expected a finite number; got {value}. Skip the workload with its "
            "reason."
        )
    made = Metric(key, value, unit, better, **rest)
    if better not in BETTER or made.rel_tol < 0 or made.abs_tol < 0:
        raise ValueError(
            f"metric {key}: expected better in {BETTER} and tolerances >= 0; got {made}."
        )
    return made


def exact(key: str, value) -> Metric:
    """A count that must not change: regions, violations, unknown verdicts."""
    return metric(key, value, "count", "same")


def times(key: str, seconds, batch: int = 0, dtype: str = "float64") -> list[Metric]:
    """Median, 95th percentile and maximum of wall times [s]; the rarer the event, the looser the
    tolerance.
    """
    seconds = np.asarray(seconds, float)
    values = (
        ("median", np.median(seconds), LOOSE),
        ("p95", np.quantile(seconds, 0.95), 1.0),
        ("max", seconds.max(), 3),
    )
    return [
        metric(
            f"{key}.{name}",
            value,
            "s",
            "lower",
            rel_tol=tol,
            abs_tol=1e-3,
            batch=batch,
            dtype=dtype,
        )
        for name, value, tol in values
    ]


def rate(key: str, items: int, seconds, batch: int = 0, dtype: str = "float64") -> Metric:
    """Items per second from the median of wall times [s]."""
    value = items / float(np.median(seconds))
    return metric(key, value, "1/s", "higher", rel_tol=LOOSE, batch=batch, dtype=dtype)


def ratio(key: str, slow: float, fast: float) -> Metric:
    """How many times faster; side by side in one run, so it may be compared across machines."""
    return metric(key, slow / fast, "x", "higher", rel_tol=LOOSE)


def repeated_keys(metrics: Sequence[Metric]) -> list[str]:
    """Keys that occur more than once."""
    keys = [m.key for m in metrics]
    return sorted({key for key in keys if keys.count(key) > 1})
