"""What a study runs, from rollouts to a proved safe set: one frozen record."""

from dataclasses import dataclass
from typing import Literal

from parc_jax.base.options import check_count
from parc_jax.claim.asked import BoundSettings
from parc_jax.claim.counts import MOST
from parc_jax.network.fit import Training
from parc_jax.settings import Search


@dataclass(frozen=True)
class Learning(BoundSettings, Training):
    """What is learned of a system: networks, and the claims about them."""

    discard: int | Literal["most"] = MOST
    profile_runs: int | None = 0
    others: tuple[tuple[int, ...], ...] = ()
    """Widths of further networks, for a table that compares them."""
    plant: str | None = None
    """Plant of the simulator that training and claims are drawn from, e.g. mjx or ode; the replay
    of a study is of the system's own, unless the shell names one. Default: the system's own."""
    body: str | None = None
    """Body of the robot, which says what points of it are learned, e.g. rectangle or disc. Default:
    the system's own."""

    @property
    def networks(self) -> tuple[tuple[int, ...], ...]:
        """All sizes, the returned one first."""
        return (self.hidden, *(h for h in self.others if h != self.hidden))


@dataclass(frozen=True)
class Study(Search, Learning):
    """Settings of a study of one system: what is learned, the query, and the replay. Raises
    InputError for values without meaning.
    """

    others: tuple[tuple[int, ...], ...] = ((6, 6, 6, 6), (7, 7, 7, 7), ())
    repeats: int = 1
    """Runs of each returned plan in the replay, with fresh randomness."""
    driven: bool = False
    """Choose one plan, run it afresh and make a local claim near it, and say what is then known of
    it [T23]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_count("repeats", self.repeats, 1, "1 for a single run of each plan")


def name_of(hidden: tuple[int, ...]) -> str:
    """A network's name: its widths, or PARC."""
    return "-".join(map(str, hidden)) or "PARC"
