"""What an answer under uncertainty withstands, in words, and what its sensing may miss. [T21]"""

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from parc_jax.common.sets.box import Box
from parc_jax.learning.model import TrajectoryModel
from parc_jax.problem.robust.realisations import Executions, told
from parc_jax.problem.uncertainty import Uncertainty

OF_COPIES = (
    "Under this uncertainty of execution or heading a few executions stand for all, and more than "
    "all: what is not safe is a plan that this method cannot show to withstand it."
)


class Robustness(NamedTuple):
    """words: "every start within ..."; for sentences. sensing_eps: probability with which the truth
    may lie outside of what was asked. parameters: (all of k, those chosen); where some are not
    chosen nothing is promised of a drawn plan. k_volume: of K as the claim has it, in units of k
    multiplied, where all of k is chosen. copies: several executions or headings stand for all, by a
    hull that holds more than them; then "no plan" is none that could be shown to withstand it.
    """

    words: str
    sensing_eps: Fraction
    parameters: tuple[int, int]
    k_volume: float
    copies: bool = False

    def volume_of_k(self, domain: Box) -> float:
        """Of K as the claim has it; of the domain of those parameters that are chosen, where not
        all are.
        """
        return self.k_volume if len(set(self.parameters)) == 1 else domain.volume

    def share_of_k(self, domain: Box) -> float:
        """Share of K, as the claim has it, in which plans may be chosen; 1 where some parameters
        are not chosen at all.
        """
        return domain.volume / self.volume_of_k(domain)

    def of_none(self, told: str) -> str:
        """A sentence that no safe plan is there, or how many are, with what safe means in it."""
        about = f"{told} Safe means here: safe for {self.words}."
        return f"{about} {OF_COPIES}" if self.copies else about

    def to_json(self) -> dict:
        """As plain data, for the answer file."""
        return self._asdict() | {"sensing_eps": str(self.sensing_eps)}


def withstood(
    uncertainty: Uncertainty, executions: Executions, model: TrajectoryModel, copies: bool
) -> Robustness:
    """Of an uncertainty about plans of this model, executed so."""
    volume = float(np.prod(model.domain.hi - model.domain.lo))
    parameters = (model.n_k, len(executions.chosen))
    return Robustness(
        words(uncertainty, executions), uncertainty.sensing_eps, parameters, volume, copies
    )


def words(uncertainty: Uncertainty, executions: Executions) -> str:
    """What a robust answer holds for: "every start within ±0.05, ±0.05 m ..."."""
    rough, known = executions.words
    parts = []
    if any(uncertainty.start):
        parts.append(f"every start within {_spread(uncertainty.start)} m of the one asked about")
    if uncertainty.heading:
        parts.append(f"every heading within ±{told(uncertainty.heading)} rad")
    parts += rough
    if any(uncertainty.goal):
        parts.append(f"every goal moved by up to {_spread(uncertainty.goal)}")
    if any(s is not None for s in uncertainty.obstacles):
        parts.append("every place of the obstacles that fits what was seen of them")
    return "; ".join([*parts, *known])


def _spread(widths: Sequence[float]) -> str:
    return ", ".join(f"±{told(w)}" for w in widths)


def robustness_of_json(data: dict | None) -> Robustness | None:
    """That of `to_json`."""
    if data is None:
        return None
    n_k, chosen = data["parameters"]
    eps = Fraction(data["sensing_eps"])
    copies = data.get("copies", False)
    return Robustness(data["words"], eps, (n_k, chosen), float(data["k_volume"]), copies)
