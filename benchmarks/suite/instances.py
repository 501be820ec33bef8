"""The instances: a row each of instances.csv, with what belongs to it."""

import csv
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from benchmarks.suite.bad import Refused
from benchmarks.suite.boxes import BlackBox, load
from benchmarks.suite.scene import Scene, read_scene

HERE = Path(__file__).parent
SIZES = ("small", "medium", "large")  # each holds those before it


@dataclass(frozen=True)
class Instance:
    """A question to entries.

    budget: runs that preparing and this answer may use together. eps, delta: a plan drawn from the
    answer may fail with probability eps, and that may be wrong with probability delta. limit_s: [s]
    for preparing, and for the answer. known: "none" where no plan exists by construction, else "".
    trap: what is wrong with the box or the scene, for people. plans, repeats: how truth is drawn.
    moved: the scene in TOML where it is not that of the file.
    """

    id: str
    size: str
    box: str
    budget: int
    eps: float
    delta: float
    limit_s: float
    plans: int
    repeats: int
    known: str
    trap: str
    moved: str = ""

    @property
    def scene_path(self) -> Path:
        return HERE / "scenes" / f"{self.id}.toml"

    @property
    def scene_text(self) -> str:
        """The scene as entries get it: no id, no comment."""
        lines = (self.moved or self.scene_path.read_text()).splitlines()
        return "".join(f"{line}\n" for line in lines if not line.startswith("#"))

    @cached_property
    def black_box(self) -> BlackBox:
        return _box(self.box)

    @cached_property
    def scene(self) -> Scene:
        box = self.black_box
        return read_scene(self.scene_text, self.id, box.points, box.n_p, len(box.q))

    @property
    def bounds(self) -> np.ndarray:
        """(2, n_p + n_k) of all plans that may be answered."""
        return np.concatenate([self.scene.start, [self.black_box.k_lo, self.black_box.k_hi]], 1)

    @property
    def task(self) -> dict:
        """What an entry is told beside the scene."""
        asked = ("budget", "eps", "delta", "limit_s")
        return self.black_box.public() | {name: getattr(self, name) for name in asked}


_boxes: dict[str, BlackBox] = {}


def _box(name: str) -> BlackBox:
    if name not in _boxes:
        _boxes[name] = load(name)
    return _boxes[name]


def instances(size: str = SIZES[-1], names=(), path=HERE / "instances.csv") -> list[Instance]:
    """The instances up to a size, or those whose ids begin with one of some names. Raises
    Refused.
    """
    with Path(path).open(newline="") as file:
        found = [_instance(row) for row in csv.DictReader(file)]
    if names:
        found = [one for one in found if one.id.startswith(tuple(names))]
    else:
        found = [one for one in found if SIZES.index(one.size) <= SIZES.index(size)]
    if not found:
        raise Refused(
            f"instances: expected ids such as puck_01; none begins with {', '.join(names)}."
        )
    return found


def _instance(row: dict) -> Instance:
    kinds = {name: kind for name, kind in Instance.__annotations__.items() if name != "moved"}
    if row.keys() != kinds.keys() or row["size"] not in SIZES:
        raise Refused(f"instances: expected {', '.join(kinds)} in a row; got {row}.")
    return Instance(**{name: kind(row[name]) for name, kind in kinds.items()})
