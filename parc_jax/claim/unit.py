"""What is independent among runs, and so what a claim speaks of and counts: single runs, or the
recordings that they are parts of.
"""

from typing import NamedTuple


class Unit(NamedTuple):
    """Words for one kind. each: what a claim speaks of. many: what it counts."""

    each: str
    many: str


RUNS = Unit("a new rollout", "runs")
RECORDINGS = Unit("any run of a new recording", "recordings")


RECORDED_ROWS = "rows"  # evidence of a claim about recordings: of how many runs they are
