"""How a query is answered: sizes, probabilities, budgets and the method, as one frozen record."""

import dataclasses
from dataclasses import dataclass

from parc_jax.errors import InputError


@dataclass(frozen=True)
class Settings:
    """What `Planner.solve` and `Planner.solve_batch` do for a query. Presets: `fast`, `whole`,
    `thorough`; `replace` changes some fields of one. Raises InputError for values without meaning.

    n_samples: safe plans to return.
    target, confidence: the corridors (with `polytopes`, these too) leave out at most `target` of
        the model's safe set, with this confidence, unless the budget ends first.
    budget_s: [s] for the search after the compiler is done; 0 grows nothing: samples only.
    polytopes: cut the corridors into polytopes too, region by region: several times the work, and
        out of reach with many parameters. `Answer.with_polytopes` cuts them later.
    proof: check all that is returned in exact arithmetic.
    no_plan_budget_s: [s] for a proof that there is no safe plan, spent only when none was drawn.
    method: how the search is done: `Published(lps)`, or anything with its `search`; None is the
        exact engine, `Exact()`.
    """

    n_samples: int = 100
    target: float = 0.01
    confidence: float = 0.99
    budget_s: float = 20.0
    polytopes: bool = False
    proof: bool = True
    no_plan_budget_s: float = 5.0
    method: object | None = None

    def __post_init__(self):
        if not 0 < self.target < 1 or not 0 < self.confidence < 1:
            raise InputError(
                "settings: expected target and confidence between 0 and 1; got "
                f"{self.target}, {self.confidence}."
            )
        if self.n_samples < 1:
            raise InputError(f"settings: expected n_samples >= 1; got {self.n_samples}.")
        if not (self.budget_s >= 0 and self.no_plan_budget_s >= 0):
            raise InputError(
                "settings: expected budgets of at least 0 s; got "
                f"{self.budget_s}, {self.no_plan_budget_s}."
            )
        if self.method is not None and not callable(getattr(self.method, "search", None)):
            raise InputError(
                f"settings: expected method Exact() or Published(lps=...); got {self.method!r:.40}."
            )

    @classmethod
    def fast(cls) -> "Settings":
        """A few safe plans as soon as they are found: no sets, no exact proof, no proof of
        absence.
        """
        return cls(n_samples=4, budget_s=0.0, proof=False, no_plan_budget_s=0.0)

    @classmethod
    def whole(cls) -> "Settings":
        """The whole safe set but one hundredth, as corridors, proved."""
        return cls()

    @classmethod
    def thorough(cls) -> "Settings":
        """All but three thousandths, at confidence 0.999, with time for slivers and for proofs of
        absence.
        """
        return cls(target=0.003, confidence=0.999, budget_s=120.0, no_plan_budget_s=60.0)

    def replace(self, **changes) -> "Settings":
        """The same but for the given fields."""
        known = [f.name for f in dataclasses.fields(self)]
        unknown = sorted(set(changes) - set(known))
        if unknown:
            raise InputError(
                f"settings: expected fields among {', '.join(known)}; got {unknown[0]!r}."
            )
        return dataclasses.replace(self, **changes)
