"""Black boxes: a box is what `box(variant)` of a module returns; anybody's module will do."""

import importlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.suite.bad import Refused

TOYS = ("puck", "bar")
ROBOTS = ("drift_parking", "asv", "f110", "tractor", "drone", "jackal")
SEPARATOR = ":"  # between the name of a box and that of its variant


@dataclass(frozen=True)
class BlackBox:
    """Something that can be run and not looked into.

    rollout: (p0 (n, n_p), k (n, n_k), seed) -> p (n, records * fine + 1, points, n_p) [m], where
        the reference points truly are, and q (n, n_q), other states at the end. The same for the
        same arguments; all chance is in the seed; a run that failed is NaN.
    k_lo, k_hi (n_k,): the parameters. records: how many an entry sees of a run after its start, dt
    [s] apart. fine: what the scorer sees for each of them. speed: [m/s] that no point exceeds along
    any axis, where anybody knows.
    """

    name: str
    rollout: Callable[[np.ndarray, np.ndarray, int], tuple[np.ndarray, np.ndarray]]
    k_lo: tuple[float, ...]
    k_hi: tuple[float, ...]
    n_p: int
    dt: float
    records: int
    points: tuple[str, ...] = ("reference",)
    q: tuple[str, ...] = ()
    fine: int = 1
    speed: float | None = None

    def public(self) -> dict:
        """What an entry is told: not the variant, whose name tells the trap."""
        hidden = ("rollout", "fine")
        told = {name: value for name, value in vars(self).items() if name not in hidden}
        return told | {"name": self.name.partition(SEPARATOR)[0]}


def load(name: str) -> BlackBox:
    """The box of a name such as "puck" or "puck:jumps", of ours or, with dots, of anybody's module
    (`yours.box`). Raises Refused.
    """
    own, _, variant = name.partition(SEPARATOR)
    if own in ROBOTS:
        try:
            from benchmarks.suite.boxes.robots import robot

            return robot(name, own)
        except ModuleNotFoundError as missing:
            hint = "pip install -e '.[dev]' in the clone"
            raise Refused(f"box {own}: expected parc_jax and sims; {missing}; {hint}.") from None
    if own not in TOYS and "." not in own:
        raise Refused(
            f"box: expected one of {', '.join(TOYS + ROBOTS)}, or a module with dots in its name; "
            f"got {own!r}."
        )
    module = importlib.import_module(f"benchmarks.suite.boxes.{own}" if own in TOYS else own)
    return module.box(variant)
