"""What the workloads of one run share: size, seeds, learned models."""

from dataclasses import dataclass, field
from pathlib import Path

import jax

from benchmarks.cases import Case, case
from benchmarks.models import CaseModels, learn
from benchmarks.result import Skip
from parc_jax.learning.model import TrajectoryModel, load

ROOT = Path(__file__).resolve().parents[1]


@dataclass
class Bench:
    """One run. quick: tiny sizes, to see that everything works; its numbers mean nothing.

    platform: "cpu" or "gpu". saved: file of a learned drift model. reference: folder of networks
        counted elsewhere.
    """

    quick: bool = False
    platform: str = "cpu"
    saved: Path = ROOT / "tests" / "data" / "drift_4x8.npz"
    reference: Path = ROOT.parent / "shared" / "data" / "nets"
    known: dict[str, CaseModels] = field(default_factory=dict)

    def size(self, full, quick):
        """A size: the full one, or the quick one."""
        return quick if self.quick else full

    def key(self, number: int = 0) -> jax.Array:
        """The random key of a seed."""
        return jax.random.PRNGKey(number)

    def model(self) -> tuple[Case, TrajectoryModel]:
        """The drift case and its saved 4x8 model. Raises Skip."""
        if not self.saved.is_file():
            raise Skip(
                f"the saved model {'/'.join(self.saved.parts[-3:])} is not in this installation"
            )
        return case("drift"), load(self.saved)

    def learned(self, name: str) -> CaseModels:
        """Everything learned of a case; learned once per run."""
        if name not in self.known:
            self.known[name] = learn(case(name), self.key(), self.quick)
        return self.known[name]
