"""What is learned of a system: networks and claims, as one frozen record."""

from dataclasses import dataclass

from parc_jax.common.errors import InputError, expected
from parc_jax.learning.bound.asked import BoundSettings
from parc_jax.learning.network.fit import Training

PARC = "PARC"  # the published method before networks: one affine map


@dataclass(frozen=True)
class Learning(BoundSettings, Training):
    """What is learned of a system: networks, and the claims about them."""

    profile_runs: int | None = 0
    others: tuple[str, ...] = ()
    """Networks to compare with the returned one, in a table: by their widths, e.g. 6-6-6-6, or
    PARC, one affine map. The error probability delta is split over all of them. Default: none."""
    plant: str | None = None
    """Plant of the simulator that training and claims are drawn from, e.g. mjx or ode; the replay
    of a study is of the system's own, unless the shell names one. Default: the system's own."""
    body: str | None = None
    """Body of the robot, which says what points of it are learned, e.g. rectangle or disc. Default:
    the system's own."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in self.others:
            widths_of(name)

    @property
    def networks(self) -> tuple[tuple[int, ...], ...]:
        """All sizes, the returned one first."""
        others = map(widths_of, self.others)
        return (self.hidden, *(widths for widths in others if widths != self.hidden))


def name_of(hidden: tuple[int, ...]) -> str:
    """A network's name: its widths, or PARC."""
    return "-".join(map(str, hidden)) or PARC


def widths_of(name: str) -> tuple[int, ...]:
    """The widths of a network by its name. Raises InputError."""
    parts = [] if name == PARC else str(name).split("-")
    if not all(part.isdecimal() and int(part) > 0 for part in parts):
        raise InputError(expected("others", "widths joined by -, or PARC", name, "6-6-6-6"))
    return tuple(map(int, parts))
