"""What a workload hands back."""

from dataclasses import dataclass, field

from benchmarks.metrics import Metric


class Skip(Exception):
    """This workload cannot run here; the message says why and goes into the report."""


@dataclass(frozen=True)
class Table:
    """Rows of text for people. note: what to keep in mind when reading it."""

    title: str
    header: tuple[str, ...]
    rows: list[tuple[str, ...]]
    note: str = ""

    def to_json(self) -> dict:
        """Plain dictionary."""
        rows = [list(row) for row in self.rows]
        return {"title": self.title, "header": list(self.header), "rows": rows, "note": self.note}


@dataclass(frozen=True)
class Result:
    """metrics: all numbers. tables: the same numbers side by side. data: curves for figures,
    JSON-able.
    """

    metrics: list[Metric]
    tables: list[Table] = field(default_factory=list)
    data: dict = field(default_factory=dict)


def milliseconds(seconds: float) -> str:
    """A time for people: ms below a second."""
    return f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def percent(share: float) -> str:
    """A share for people."""
    return f"{100 * share:.3g} %"
