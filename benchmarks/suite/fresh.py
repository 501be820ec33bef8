"""Fresh instances, which nobody can have answered before: the scenes of a size, moved by a seed
that is drawn when the entries are frozen.
"""

import hashlib
import json
import tomllib
from dataclasses import replace

import numpy as np

from benchmarks.suite.bad import Refused
from benchmarks.suite.binomial import tail
from benchmarks.suite.boxes import SEPARATOR, TOYS
from benchmarks.suite.entries.kit import SCARCE
from benchmarks.suite.instances import Instance
from benchmarks.suite.score import share_failing

ALL, EACH, TURN = 0.3, 0.06, 0.05  # [m], [m], further states: start, goal and obstacles move by
TRIES, SHORTER = 12, 0.8  # a scene that broke the rule moves by so much less
SELDOM, PLANS = 0.01, 4000  # as seldom would so many of these be good without the rule
TABLES = ("start", "goal", "body", "obstacles")


def fresh(one: Instance, seed: str) -> Instance:
    """The instance, moved: start, goal and all obstacles together, so that its truth stays, but
    where the world belongs to the box; of toys with plans also goal and obstacles each, as far as
    the rule of the suite allows. Raises Refused.
    """
    digest = hashlib.sha256(f"{seed} {one.id}".encode()).digest()
    rng = np.random.default_rng(int.from_bytes(digest[:16], "big"))
    own = one.box.partition(SEPARATOR)[0]
    if own not in TOYS or one.known:
        return replace(one, moved=_moved(one, rng, 0.0))
    for i in range(TRIES):
        found = replace(one, moved=_moved(one, rng, SHORTER**i))
        plans = rng.uniform(*found.bounds, (PLANS, found.bounds.shape[1]))
        good = int((share_failing(found, plans, found.eps) <= found.eps).sum())
        if tail(PLANS, good, SCARCE) < SELDOM:
            return found
    raise Refused(f"{one.id}: expected a scene with plans; with seed {seed} none has enough.")


def _moved(one: Instance, rng: np.random.Generator, part: float) -> str:
    """The scene as TOML; the goal and each obstacle move by a part of EACH of their own."""
    data = tomllib.loads(one.scene_path.read_text())
    n_p = one.black_box.n_p
    together = rng.uniform(-ALL, ALL, n_p) * (not one.black_box.fixed)

    def shift(table, by):
        for word in table.keys() & {"lo", "hi"}:
            table[word] = [x + (by[i] if i < len(by) else 0.0) for i, x in enumerate(table[word])]
        if "vertices" in table:
            table["vertices"] = [
                [x + d for x, d in zip(v, by, strict=True)] for v in table["vertices"]
            ]

    shift(data["start"], together)
    for table in [data["goal"], *data.get("obstacles", [])]:
        shift(table, together + part * rng.uniform(-EACH, EACH, n_p))
    if "q" in data["goal"]:
        shift(data["goal"]["q"], part * rng.uniform(-TURN, TURN, len(data["goal"]["q"]["lo"])))
    return "\n".join(line for name in TABLES for line in _lines(name, data.get(name, [])))


def _lines(name: str, value: dict | list) -> list[str]:
    """A table, or several, as TOML."""
    if isinstance(value, list):
        found = []
        for table in value:
            found += [f"[[{name}]]", *_lines("", table)]
        return found
    found = [f"[{name}]"] if name else []
    inner = {key: x for key, x in value.items() if isinstance(x, dict)}
    found += [f"{key} = {json.dumps(x)}" for key, x in value.items() if key not in inner]
    for key, table in inner.items():
        found += _lines(f"{name}.{key}", table)
    return found
