"""What the entries by parc_jax share: runs as it takes them, models, scenes, sets as answers."""

import math
from pathlib import Path

import jax
import numpy as np

import parc_jax as pj
from benchmarks.suite.answer import Piece, Sets
from benchmarks.suite.entries import kit
from parc_jax.claim.intersample import DISCRETE_TIME, SpeedBound
from parc_jax.published.cells import cells_outward
from parc_jax.published.scene import paper_scene
from parc_jax.published.search import SAMPLES_PER_REGION, paper_search
from parc_jax.rollout.batch import RolloutBatch, rollout_batch
from parc_jax.rollout.law import law_spec

KNOTS = 40  # of a model, at most
AS_PUBLISHED = SAMPLES_PER_REGION
KEY = jax.random.PRNGKey(0)
DIGITS = 6  # of a row of length 1 in an answer; what is rounded away is taken from its set
PIECES = 100  # polytopes of an answer: the largest
PLANS = 500  # of an answer


def domain(task: kit.Task) -> pj.types.Box:
    """K."""
    return pj.box(task.k_lo, task.k_hi)


def grid(task: kit.Task) -> pj.types.TimeGrid:
    """Every record, and as many knots as are allowed."""
    records, dt = task.told["records"], task.told["dt"]
    stride = next(s for s in range(1, records + 1) if records % s == 0 and records // s <= KNOTS)
    return pj.time_grid(stride * dt, records * dt, dt)


def runs(task: kit.Task, rng, n: int, k=None) -> RolloutBatch:
    """n runs from the origin, of parameters k (n, n_k) or uniform ones."""
    law = "uniform" if k is None else "given"
    k = task.draw(rng, n) if k is None else k
    p, q = task.runs(np.zeros((len(k), task.n_p)), k)
    points = tuple(task.told["points"])
    p = p.reshape(*p.shape[:2], -1)
    about = {"time": grid(task), "domain": domain(task), "points": points}
    return rollout_batch(k, p, q, law=law_spec(task.told["name"], domain(task), law), **about)


def between(task: kit.Task):
    """What the robot may do between records."""
    speed = task.told["speed"]
    return DISCRETE_TIME if speed is None else SpeedBound(speed)


def scene(task: kit.Task, path) -> pj.types.ReachAvoid:
    """The scene as parc_jax reads it."""
    return pj.exchange.load_problem(path, points=tuple(task.told["points"]))


def needed(task: kit.Task) -> int:
    """Runs none of which fails, after which failures with eps are refuted at delta."""
    return math.ceil(math.log(task.delta) / math.log1p(-task.eps))


def polytopes(answer: pj.types.Answer) -> list[dict]:
    """The largest safe polytopes of an answer, as the suite spells them."""
    corners = answer.project(range(answer.model.n_p + answer.model.n_k))
    largest = np.argsort(-answer.volumes())[:PIECES]
    sets = answer.safe_sets()
    return [_spelled(sets[i], corners[i]) for i in largest]


def _spelled(polytope: pj.types.HPolytope, corners: np.ndarray) -> dict:
    lo, hi = corners.min(axis=0), corners.max(axis=0)
    length = np.linalg.norm(polytope.A, axis=1)
    A = np.round(polytope.A / length[:, None], DIGITS)
    farthest = np.abs(corners).max(axis=0).sum()
    b = np.round(polytope.b / length - (1 + farthest) * 10.0**-DIGITS, DIGITS)
    return {"A": A.tolist(), "b": b.tolist(), "lo": lo.tolist(), "hi": hi.tolist()}


def published(
    model: pj.types.TrajectoryModel, asked: pj.types.ReachAvoid, samples: int
) -> list[list[float]]:
    """Plans of the published search, so many draws a region; none where it has no word for the
    scene, or the tube leaves no goal.
    """
    try:
        cells = cells_outward(model.regions, model.tube, model.domain.center)
        found = paper_search(KEY, cells, paper_scene(asked, model.tube), samples=samples)
    except pj.InputError as error:
        print(error)
        return []
    some = np.random.default_rng(0).permutation(len(found.samples))[:PLANS]
    return found.samples[some].round(DIGITS).tolist()


def drawn(found: list[dict], rng, n: int) -> np.ndarray | None:
    """n plans (n, d), evenly from polytopes as they are spelled; None where they are empty."""
    pieces = tuple(
        Piece(*(np.array(one[word]) for word in ("lo", "hi", "A", "b"))) for one in found
    )
    sets = Sets(pieces, rng) if pieces else None
    return sets.draw(n) if sets else None


def name_of(folder) -> Path:
    """Where the model of a folder is."""
    return Path(folder) / "model.npz"
