"""What entries of ours share: files in, runs, answers out; a network; sets of boxes."""

import json
import math
import os
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.suite.scene import Scene, load_scene

MOST = 1 << 16  # runs of one request
SETS = 2000  # of an answer
SCARCE = 1 / 200  # of plans drawn evenly succeed in every scene that has a plan: so says the suite


class Task:
    """What an entry is told, and runs."""

    def __init__(self, path):
        self.told = json.loads(Path(path).read_text())
        self.k_lo, self.k_hi = np.array(self.told["k_lo"]), np.array(self.told["k_hi"])
        self.budget, self.eps, self.delta = (self.told[n] for n in ("budget", "eps", "delta"))
        self.n_p, self.used = self.told["n_p"], 0

    def scene(self, path) -> Scene:
        points = tuple(self.told["points"])
        return load_scene(path, points, self.n_p, len(self.told["q"]))

    def draw(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """Parameters (n, n_k), uniform."""
        return rng.uniform(self.k_lo, self.k_hi, (n, len(self.k_lo)))

    def bounds(self, scene: Scene) -> np.ndarray:
        """(2, n_p + n_k) of all plans that may be answered."""
        return np.concatenate([scene.start, [self.k_lo, self.k_hi]], axis=1)

    def runs(self, p0: np.ndarray, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """p (n, records + 1, points, n_p), q (n, n_q) of starts p0 (n, n_p), k (n, n_k)."""
        found = []
        for first in range(0, len(k), MOST):
            some = slice(first, first + MOST)
            np.savez("ask.npz", p0=p0[some], k=k[some])
            subprocess.run([os.environ["SUITE_ROLLOUT"], "ask.npz", "runs.npz"], check=True)
            with np.load("runs.npz") as file:
                found.append((file["p"], file["q"]))
        self.used += len(k)
        return tuple(np.concatenate(parts) for parts in zip(*found, strict=True))


def arguments() -> list[str]:
    """Paths that the program was called with."""
    return sys.argv[1:]


def answer(path, **told) -> None:
    """Write an answer: without plans it is "unknown"."""
    verdict = told.pop("verdict", "some" if any(map(len, told.values())) else "unknown")
    Path(path).write_text(json.dumps({"verdict": verdict, **told}))


def first(plan: np.ndarray) -> None:
    """Say that there is a first plan."""
    Path("first.json").write_text(json.dumps(plan.tolist()))


def enough(task: Task) -> int:
    """Plans drawn evenly that all fail with probability delta, were there a plan and as many as the
    suite promises.
    """
    return math.ceil(math.log(task.delta) / math.log1p(-SCARCE * (1 - task.eps)))


def nobody(task: Task, scene: Scene, rng: np.random.Generator, most: int) -> bool:
    """Whether none of `enough` plans drawn evenly from start x K succeeds. most: runs that may be
    spent; False where that is too few.
    """
    n = enough(task)
    if n > most:
        return False
    lo, hi = task.bounds(scene)
    plans = rng.uniform(lo, hi, (n, len(lo)))
    return not scene.succeeds(*task.runs(*np.split(plans, [task.n_p], axis=1))).any()


def train(x, y, hidden=(32, 32), steps=3000, seed=0, batch=256) -> list:
    """Weights of a ReLU network from x (n, n_x) to y (n, n_y), by Adam on mean squares; x and y
    should be of size 1.
    """
    rng = np.random.default_rng(seed)
    sizes = (x.shape[1], *hidden, y.shape[1])
    weights = []
    for a, b in pairwise(sizes):
        weights += [rng.normal(0, np.sqrt(2 / a), (a, b)), np.zeros(b)]
    moments = [[np.zeros_like(w), np.zeros_like(w)] for w in weights]
    for step in range(1, steps + 1):
        rows = rng.integers(len(x), size=min(batch, len(x)))
        rate = 3e-3 * 0.5 * (1 + np.cos(np.pi * step / steps))
        for w, m, g in zip(weights, moments, _gradients(weights, x[rows], y[rows]), strict=True):
            m[0] = 0.9 * m[0] + 0.1 * g
            m[1] = 0.999 * m[1] + 0.001 * g * g
            w -= rate * (m[0] / (1 - 0.9**step)) / (np.sqrt(m[1] / (1 - 0.999**step)) + 1e-8)
    return weights


def network(weights, x) -> np.ndarray:
    """y (n, n_y) of x (n, n_x)."""
    return _layers(weights, x)[-1]


def _layers(weights, x) -> list:
    found = [x]
    for i in range(0, len(weights), 2):
        x = x @ weights[i] + weights[i + 1]
        x = x if i + 2 == len(weights) else np.maximum(x, 0.0)
        found.append(x)
    return found


def _gradients(weights, x, y) -> list:
    layers, found = _layers(weights, x), []
    back = 2 * (layers[-1] - y) / len(x)
    for i in range(len(weights) - 2, -1, -2):
        found = [layers[i // 2].T @ back, back.sum(axis=0), *found]
        back = (back @ weights[i].T) * (layers[i // 2] > 0)
    return found


def boxes(safe, lo, hi, rng: np.random.Generator, n=150_000, fewest=24, again=400) -> list[dict]:
    """Boxes between lo and hi (d,) in which all that is drawn is safe: cut in halves, side by side,
    until all draws in a piece agree; what is kept is drawn anew. The largest, if they are too many.
    safe: plans (n, d) -> bool (n,).
    """
    plans = rng.uniform(lo, hi, (n, len(lo)))
    good = safe(plans)
    found, left = [], [(np.array(lo), np.array(hi), plans, good, 0)]
    while left:
        low, high, some, fine, depth = left.pop()
        if len(some) < fewest or not fine.any():
            continue
        if fine.all():
            if safe(rng.uniform(low, high, (again, len(low)))).all():
                found.append({"lo": low.tolist(), "hi": high.tolist()})
            continue
        axis = depth % len(low)
        middle = 0.5 * (low[axis] + high[axis])
        above = some[:, axis] > middle
        below_high, above_low = high.copy(), low.copy()
        below_high[axis] = above_low[axis] = middle
        left.append((low, below_high, some[~above], fine[~above], depth + 1))
        left.append((above_low, high, some[above], fine[above], depth + 1))
    return sorted(found, key=lambda one: -np.prod(np.subtract(one["hi"], one["lo"])))[:SETS]
