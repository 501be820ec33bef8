"""Outcomes of recorded runs in a scene: no model, no tube, the truth as far as it was recorded."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from parc_jax.common.arrays import map_rows, slices
from parc_jax.common.shapes import Index, Items, Knot, Path
from parc_jax.learning.bound.error_set import ErrorBox
from parc_jax.learning.network.predict import moved_to
from parc_jax.learning.runs.batch import RolloutBatch
from parc_jax.safe_set.verdict.scene import Scene, Tabled
from parc_jax.safe_set.verdict.screen import along_facets, facet_gap

CHUNK = 32  # runs per compiled call: what a call holds of its records stays in cache
ROUND = 512  # runs whose intervals are told apart at a time
ITEMS = 256  # intervals per compiled search for a direction


def outcomes(
    scene: Scene, runs: RolloutBatch, p0: np.ndarray, off: float = 0.0, enough: float = np.inf
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Outcomes of runs from p0 (n, n_p).

    Returns the path (n, n_record + 1, n_c) [m], whether the goal was reached (n,), and the smallest
    distance (n,) [m] from an obstacle; one beyond `enough` may be any that the run keeps. A failed
    run reached nothing. off: of the goal alone, as of `reached_and_touched`.
    """
    path = moved_to(p0, np.asarray(runs.p, np.float64))
    reached = reaches(scene, path, runs.q, off)
    # without rounding tolerance, in metres: of the hull of each part at two records in a row, so
    # that nothing between them is missed
    tabled = scene.tabled
    active = tabled.obstacles.active.repeat(runs.time.stride, axis=1)
    fine = tabled.replace(
        obstacles=tabled.obstacles.replace(active=active),
        slack=np.float64(0),
        directions=tabled.directions.of_unit_length,
    )
    rounds = slices(len(path), ROUND)
    return path, reached, np.concatenate([_nearest(fine, path[rows], enough) for rows in rounds])


def reaches(scene: Scene, path: np.ndarray, q: np.ndarray, off: float) -> np.ndarray:
    """(n,) bool: the end of path (n, ..., n_c) and q (n, n_q), each off by so much, in the goal."""
    lost = off * np.abs(scene.goal_A).sum(axis=1)
    state = np.concatenate([path[:, -1], q], axis=1)
    return (state @ scene.goal_A.T <= scene.goal_b - lost).all(axis=1)


def reached_and_touched(
    scene: Scene, runs: RolloutBatch, p0: np.ndarray, off: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Whether the goal was reached, and whether an obstacle was touched, (n,) each.

    off: [m or rad] by which each coordinate of a run that truly begins there may differ: reached
    and not touched for any such run.
    """
    # a point that is off by so much in each coordinate is as far away as their diagonal
    far = off * np.sqrt(scene.model.n_p)
    _, reached, distance = outcomes(scene, runs, p0, off, far)
    return reached, ~(distance > far)


def _nearest(scene: Tabled, path: np.ndarray, enough: float) -> np.ndarray:
    """Distance (n,) from the obstacles grown by the body alone. The hull for which facets promise
    least is measured first, then those for which they promise less than that. Runs that facets
    promise to be farther away than `enough` are not measured: the promise is their distance.
    """
    promised = map_rows(CHUNK, partial(_promised, scene), path)
    each = promised.reshape(len(path), -1)
    least = each.argmin(axis=1)
    found = np.take_along_axis(each, least[:, None], axis=1)[:, 0]
    some = np.flatnonzero(~(found > enough) & ~np.isposinf(found))
    worst = np.unravel_index(least[some], promised.shape[1:])
    found[some] = _measured(scene, path, some, *worst)
    run, o, t = np.nonzero(promised[some] < found[some, None, None])
    np.minimum.at(found, some[run], _measured(scene, path, some[run], o, t))
    return np.minimum(found, scene.beyond)


def _measured(scene: Tabled, path: np.ndarray, run: Items, o: Items, t: Items) -> np.ndarray:
    """Distances (i,) [m] of pairs o from runs in their intervals t, (i,) each."""
    return map_rows(ITEMS, partial(_distances, scene), path[run, t], path[run, t + 1], o)


@jax.jit
@partial(jax.vmap, in_axes=(None, 0))
def _promised(scene: Tabled, path: Path):
    """(o, T) [m] the least distance that the best facet promises of a path."""
    active = jnp.asarray(scene.obstacles.active)
    each = jnp.arange(len(active))
    gap = jax.vmap(lambda o: facet_gap(o, along_facets(o, path, scene), scene))(each)
    return jnp.where(active, gap, jnp.inf)


@jax.jit
@partial(jax.vmap, in_axes=(None, 0, 0, 0))
def _distances(scene: Tabled, start: Knot, end: Knot, o: Index):
    """Distance [m] of pair o between two records."""
    # no errors: positions of runs are as they were recorded
    n_p = scene.obstacles.vertices.shape[-1]
    return scene.obstacles.gap(o, start, end, ErrorBox(jnp.zeros((len(start) // n_p, n_p))))[0]
