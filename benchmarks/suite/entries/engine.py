"""What the entries by parc_jax share: runs as it takes them, models, scenes, sets as answers."""

from collections.abc import Sequence
from pathlib import Path

import jax
import numpy as np
from scipy.linalg import block_diag

import parc_jax as pj
from benchmarks.neuralparc.cells import cells_outward
from benchmarks.neuralparc.scene import paper_scene
from benchmarks.neuralparc.search import SAMPLES_PER_REGION, paper_search
from benchmarks.suite.answer import Piece
from benchmarks.suite.entries import kit
from parc_jax.common.sets.hull import halfspace_intersection, scaled_around
from parc_jax.learning.runs.batch import RolloutBatch, rollout_batch
from parc_jax.learning.runs.law import law_spec
from parc_jax.problem.problem_file import load_problem
from parc_jax.proof.regions import regions_of

KNOTS = 40  # of a model, at most
AS_PUBLISHED = SAMPLES_PER_REGION
KEY = jax.random.PRNGKey(0)
DIGITS = 6  # of a row of length 1 in an answer; what is rounded away is taken from its set
PLANS = 500  # of an answer
FAR = 100.0  # no further state ends beyond


def domain(task: kit.Task) -> pj.types.Box:
    """K."""
    return pj.box(task.k_lo, task.k_hi)


def grid(task: kit.Task) -> pj.types.TimeGrid:
    """Every record, and as many knots as are allowed."""
    records, dt = task.told["records"], task.told["dt"]
    stride = next(s for s in range(1, records + 1) if records % s == 0 and records // s <= KNOTS)
    return pj.learning.time_grid(stride * dt, records * dt, dt)


def runs(task: kit.Task, rng, n: int, k=None) -> RolloutBatch:
    """n runs from the origin, of parameters k (n, n_k) or uniform ones."""
    law = "uniform" if k is None else "given"
    k = task.draw(rng, n) if k is None else k
    return batch(task, k, *task.runs(np.zeros((len(k), task.n_p)), k), domain(task), law)


def batch(task: kit.Task, k, p, q, box: pj.types.Box, law: str = "uniform") -> RolloutBatch:
    """Runs as parc_jax takes them: parameters k in a box, places p from where they began."""
    p = p.reshape(*p.shape[:2], -1)
    about = {"time": grid(task), "domain": box, "points": tuple(task.told["points"])}
    return rollout_batch(k, p, q, law=law_spec(task.told["name"], box, law), **about)


def scene(task: kit.Task, path) -> pj.types.Problem:
    """The scene as parc_jax reads it, whose goals bound every further state."""
    return read_scene(path, task.told["points"], task.n_p, len(task.told["q"]))


def read_scene(path, points: Sequence[str], n_p: int, n_q: int) -> pj.types.Problem:
    """The same for these points and sizes."""
    asked = load_problem(path, tuple(points))
    told = n_p * (len(points) if asked.points else 1)
    free = told + n_q - asked.goal.n
    if not free:
        return asked
    A = block_diag(asked.goal.A, np.vstack([np.eye(free), -np.eye(free)]))
    b = np.append(asked.goal.b, np.full(2 * free, FAR))
    return asked.replace(goal=asked.goal.replace(A=A, b=b))


def spelled(polytope: pj.types.HPolytope, inside: np.ndarray) -> dict | None:
    """Without redundant rows; None where it is too thin for floats."""
    scaled = scaled_around(polytope.A, polytope.b, inside)
    cut = scaled and halfspace_intersection(*scaled[:2], np.zeros(len(inside)))
    if cut is None:
        return None
    corners = inside + cut.intersections * scaled[2]
    needed = np.unique(np.concatenate(cut.dual_facets).astype(int))
    lo, hi = corners.min(axis=0), corners.max(axis=0)
    length = np.linalg.norm(polytope.A[needed], axis=1)
    A = np.round(polytope.A[needed] / length[:, None], DIGITS)
    farthest = np.abs(corners).max(axis=0).sum()
    b = np.round(polytope.b[needed] / length - (1 + farthest) * 10.0**-DIGITS, DIGITS)
    return {"A": A.tolist(), "b": b.tolist(), "lo": lo.tolist(), "hi": hi.tolist()}


def published(
    model: pj.types.TrajectoryModel, asked: pj.types.Problem, samples: int
) -> list[list[float]]:
    """Plans of the published search, so many draws a region. Raises InputError where it has no word
    for the scene.
    """
    cells = cells_outward(regions_of(model), model.tube, model.domain.center)
    found = paper_search(KEY, cells, paper_scene(asked, model.tube), samples=samples)
    some = np.random.default_rng(0).permutation(len(found.samples))[:PLANS]
    return found.samples[some].round(DIGITS).tolist()


def piece(one: dict) -> Piece:
    """A spelled polytope as the scorer reads it."""
    lo, hi, b = (np.array(one[word], float) for word in ("lo", "hi", "b"))
    return Piece(lo, hi, np.array(one["A"], float).reshape(len(b), len(lo)), b)


def name_of(folder) -> Path:
    """Where the model of a folder is."""
    return Path(folder) / "model.npz"
