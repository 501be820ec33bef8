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
DEEP, FULL = 24, 24  # cuts of a tree in a row; draws in a leaf that is answered
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


def nobody(task: Task, scene: Scene, rng: np.random.Generator, failed: int = 0) -> bool:
    """Whether none of `enough` plans drawn evenly from start x K succeeds. failed: how many runs of
    such plans had been made, none of which succeeded. False where the budget is too small.
    """
    n = max(1, enough(task) - failed)
    if n > task.budget - task.used:
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


def cells(x, bad, lo, hi, fewest: int, worth: float, cuts: int, wide=0.0, rows=None) -> list[tuple]:
    """A tree of cells (lo, hi, numbers of points) between lo and hi (d,), cut where that tells best
    which of points x (n, d) are bad (n,).

    fewest: points of a side. worth: log-likelihood that a cut must gain. cuts: in a row, at most.
    wide: log-likelihood that a cut may lose by making the worse side larger.
    """
    rows = np.arange(len(x)) if rows is None else rows
    best = worth, None, None
    n, of_all = len(rows), bad[rows].sum()
    if cuts and 2 * fewest <= n and 0 < of_all < n:
        i = np.arange(fewest, n - fewest + 1)
        for axis in range(x.shape[1]):
            order = rows[np.argsort(x[rows, axis], kind="stable")]
            below = np.cumsum(bad[order])[i - 1]
            gain = _likelihood(i, below) + _likelihood(n - i, of_all - below)
            gain -= _likelihood(np.array([n]), np.array([of_all]))
            most = int(np.argmax(gain))
            if gain[most] > best[0]:
                near = np.flatnonzero(gain >= gain[most] - wide)
                above = below[most] / i[most] < of_all / n  # is the worse side
                j = (
                    (near[near <= most].min() if above else near[near >= most].max())
                    if wide
                    else most
                )
                best = gain[most], axis, 0.5 * (x[order[i[j] - 1], axis] + x[order[i[j]], axis])
    _, axis, at = best
    if axis is None:
        return [(np.array(lo), np.array(hi), rows)]
    middle_lo, middle_hi = np.array(lo), np.array(hi)
    middle_lo[axis] = middle_hi[axis] = at
    left = x[rows, axis] <= at
    about = fewest, worth, cuts - 1, wide
    low = cells(x, bad, lo, middle_hi, *about, rows[left])
    return low + cells(x, bad, middle_lo, hi, *about, rows[~left])


def _likelihood(n: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The log-likelihood of x failures of n, at their own share."""
    p = x / n
    some, others = np.where(x > 0, p, 1.0), np.where(x < n, 1 - p, 1.0)
    return x * np.log(some) + (n - x) * np.log(others)


def boxes(safe, lo, hi, rng, along=None, n=150_000, fewest=6, again=400) -> list[dict]:
    """Sets between lo and hi (d,) in which all that is drawn is safe, the leaves of a tree; what is
    kept is drawn anew. The largest, if they are too many.

    safe: plans (n, d) -> bool (n,). along (d, d): pieces are boxes of along @ plan, polytopes of
    the plan; by default they are boxes.
    """
    along = np.eye(len(lo)) if along is None else along
    back = np.linalg.inv(along)
    plans = rng.uniform(lo, hi, (n, len(lo)))
    good, x = safe(plans), plans @ along.T
    found = []
    for low, high, rows in cells(x, ~good, x.min(axis=0), x.max(axis=0), fewest, 0.0, DEEP):
        if len(rows) < FULL or not good[rows].all():
            continue
        drawn = rng.uniform(low, high, (again, len(low))) @ back.T
        drawn = drawn[((lo <= drawn) & (drawn <= hi)).all(axis=1)]
        if len(drawn) and safe(drawn).all():
            found.append((len(rows), _piece(low, high, along, back, lo, hi)))
    return [piece for _, piece in sorted(found, key=lambda one: -one[0])[:SETS]]


def _piece(low, high, along, back, lo, hi) -> dict:
    """{z: low <= along @ z <= high} between lo and hi."""
    middle, reach = back @ (0.5 * (low + high)), np.abs(back) @ (0.5 * (high - low))
    around = {
        "lo": np.maximum(lo, middle - reach).tolist(),
        "hi": np.minimum(hi, middle + reach).tolist(),
    }
    turned = (along != np.eye(len(lo))).any(axis=1)
    A = np.vstack([along[turned], -along[turned]])
    return {**around, "A": A.tolist(), "b": [*high[turned], *-low[turned]]}


def sheared(task: "Task", p0, k, ends) -> np.ndarray:
    """(d, d): a plan (p0, k) as where it ends, by least squares of the ends (n, n_p), and k. Sets
    of plans that reach a goal are boxes of these rather than of plans.
    """
    d = task.n_p + k.shape[1]
    x = np.hstack([p0, k, np.ones((len(k), 1))])
    fine = np.isfinite(ends).all(axis=1)
    found = np.eye(d)
    found[: task.n_p] = np.linalg.lstsq(x[fine], ends[fine], rcond=None)[0][:d].T
    return found if abs(np.linalg.det(found)) > 0.1 else np.eye(d)
