"""A scene: what is asked of a box, out of a file whose words are those of parc_jax's scene files.
Read with NumPy alone.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.suite.bad import Refused
from benchmarks.suite.contact import Obstacle, block, hull, touched

SEVERAL = ("points", "capsule", "rectangle", "box")  # words for parts between reference points


@dataclass(frozen=True)
class Scene:
    """Where runs may begin and must end, and what they must not touch.

    start: (2, n_p) [m], least and most of where the first point begins. ends: (2, points, n_p) [m]
    of where each point must end, infinite where nothing is asked; q: (2, n_q) alike of the other
    states. body: parts, each the numbers of its reference points and the radius [m] that grows
    their hull.
    """

    start: np.ndarray
    ends: np.ndarray
    q: np.ndarray
    body: tuple[tuple[list[int], float], ...]
    obstacles: tuple[Obstacle, ...]

    def succeeds(self, p: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Whether runs p (n, records + 1, points, n_p), q (n, n_q) end in the goal and touch
        nothing at any record; a run with a NaN does not.
        """
        fine = np.isfinite(p).all(axis=(1, 2, 3)) & np.isfinite(q).all(axis=1)
        fine &= ((self.ends[0] <= p[:, -1]) & (p[:, -1] <= self.ends[1])).all(axis=(1, 2))
        fine &= ((self.q[0] <= q) & (q <= self.q[1])).all(axis=1)
        left = np.flatnonzero(fine)
        for points, radius in self.body:
            for obstacle in self.obstacles:
                left = left[~touched(p[left][:, :, points], obstacle, radius)]
        found = np.zeros(len(p), bool)
        found[left] = True
        return found


def load_scene(path, points: tuple[str, ...], n_p: int, n_q: int) -> Scene:
    """The scene in a TOML file for a box with these points and states. Raises Refused.

    [start] lo, hi of the first point. [goal] lo, hi over the first point and then q; or, with
    points = ["nose", ...], over these points, and [goal.q] alike over q. [body] radius, of a disc
    about the first point; or points = [...] (also capsule, rectangle, box), the hull of these,
    grown by the radius, if any; [[body]] for each of several. [[obstacles]] lo, hi; or vertices =
    [[x, y], ...].
    """
    path = Path(path)
    try:
        text = path.read_text()
    except (OSError, ValueError) as error:
        raise Refused(f"{path.name}: expected a scene in TOML; {error}") from None
    return read_scene(text, path.name, points, n_p, n_q)


def read_scene(text: str, name: str, points: tuple[str, ...], n_p: int, n_q: int) -> Scene:
    """The same of a text; its name is for errors. Raises Refused."""
    try:
        return _scene(tomllib.loads(text), points, n_p, n_q)
    except (ValueError, KeyError, TypeError) as error:
        what = f"no entry {error}" if isinstance(error, KeyError) else str(error)
        raise Refused(f"{name}: expected a scene in TOML; {what}") from None


def _scene(data: dict, points: tuple[str, ...], n_p: int, n_q: int) -> Scene:
    goal = data["goal"]
    ends = np.stack([np.full((len(points), n_p), -np.inf), np.full((len(points), n_p), np.inf)])
    if "points" in goal:
        asked = [points.index(name) for name in goal["points"]]
        ends[:, asked] = bounds("goal", goal, n_p)[:, None]
        q = bounds("goal q", goal["q"], n_q) if "q" in goal else free(n_q)
    else:
        both = bounds("goal", goal, n_p + n_q)
        ends[:, 0], q = both[:, :n_p], both[:, n_p:]
    parts = data["body"] if isinstance(data["body"], list) else [data["body"]]
    body = tuple(_part(part, points) for part in parts)
    obstacles = tuple(_obstacle(one, n_p) for one in data.get("obstacles", ()))
    return Scene(bounds("start", data["start"], n_p), ends, q, body, obstacles)


def free(n: int) -> np.ndarray:
    """(2, n) without bounds."""
    return np.stack([np.full(n, -np.inf), np.full(n, np.inf)])


def bounds(name: str, table: dict, n: int) -> np.ndarray:
    """(2, n) of lo and hi in a table. Raises Refused."""
    both = np.array([table["lo"], table["hi"]], float)
    if both.shape != (2, n) or not (both[0] <= both[1]).all():
        raise Refused(f"{name}: expected lo <= hi, {n} numbers each; got {both.tolist()}.")
    return both


def _part(part: dict, points: tuple[str, ...]) -> tuple[list[int], float]:
    named = next((part[word] for word in SEVERAL if word in part), points[:1])
    return [points.index(name) for name in named], float(part.get("radius", 0.0))


def _obstacle(table: dict, n_p: int) -> Obstacle:
    if "vertices" in table:
        return hull(np.array(table["vertices"], float))
    return block(bounds("obstacle", table, n_p))
