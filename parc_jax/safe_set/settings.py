"""How a query is answered: sizes, probabilities, work and the method, as one frozen record."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from parc_jax.common.errors import InputError, check_count, reading
from parc_jax.common.options import Options

LOOKS = 60  # at fresh draws of at most 2^18 plans each
CORRIDORS = 4096  # tried; of a batch the best are kept
LEAVES = 1000  # boxes of a proof that there is no plan
POPULATION = 8192  # plans that climb to where some are safe, in the last climb


class Work(NamedTuple):
    """The most that a search does, counted in what is done: looks at fresh draws, corridors tried,
    boxes of a branch and bound, plans of the largest climb.
    """

    looks: int
    corridors: int
    leaves: int
    population: int


def work_of(share: float) -> Work:
    """That share of the standard work, and one of each at least."""
    return Work(*(max(1, math.ceil(share * n)) for n in (LOOKS, CORRIDORS, LEAVES, POPULATION)))


@dataclass(frozen=True)
class Settings(Options):
    """What `Planner.solve` and `Planner.solve_batch` do for a query. Presets: `fast`, `whole`;
    `replace` changes some fields of one. Raises InputError for values without meaning.
    """

    samples: int = 100
    """Safe plans to return."""
    target: float = 0.01
    """Largest share of the model's safe set the corridors may leave out, unless work ends first."""
    confidence: float = 0.99
    """Confidence in that, at least 0.5."""
    work: float = 1.0
    """The most that is done, as a multiple of the standard: 60 looks at fresh draws, 4,096
    corridors tried, and 1,000 boxes for a proof where no plan is found. It is counted, so the same
    seed gives the same answer, however busy the machine."""
    budget_s: float = 600.0
    """A limit in seconds above the work, without compiling; the answer says if it cut work off."""
    samples_only: bool = False
    """Safe plans alone; no corridor is built and nothing is covered."""
    proof: bool = True
    """Check all that is returned in exact arithmetic."""
    method: object | None = None
    """How to search: anything with a `search` as of the exact engine, `Exact()`, the default."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("target", "confidence", "work", "budget_s"):
            with reading(f"settings: {name}", "a number"):
                math.fabs(getattr(self, name))
        # with less confidence than 0.5, the bound would lie above the estimate
        if not 0 < self.target < 1 or not 0.5 <= self.confidence < 1:
            raise InputError(
                "settings: expected 0 < target < 1 and 0.5 <= confidence < 1; got "
                f"{self.target}, {self.confidence}."
            )
        check_count("settings: samples", self.samples, 1, "100")
        if not 0 < self.work < math.inf:
            raise InputError(f"settings: expected work > 0, times the standard; got {self.work}.")
        if not self.budget_s > 0:
            raise InputError(
                f"settings: expected budget_s > 0 s, a limit above the work; got {self.budget_s}. "
                "For safe plans without sets ask for samples_only=True, --first in the shell."
            )
        if self.method is not None and not callable(getattr(self.method, "search", None)):
            raise InputError(
                "settings: expected method pj.types.Exact(), or an object with such a `search`; "
                f"got {self.method!r:.40}."
            )

    @classmethod
    def fast(cls) -> "Settings":
        """A few safe plans as soon as they are found: no sets, no exact proof, next to no work for
        a proof of absence.
        """
        return cls(samples=4, work=1e-3, samples_only=True, proof=False)

    @classmethod
    def whole(cls) -> "Settings":
        """The whole safe set but one hundredth, as corridors, proved."""
        return cls()
