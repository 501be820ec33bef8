"""Points of the goal-reaching set, drawn without rejection and without a search over regions. [T15]"""

from typing import NamedTuple

import jax
import numpy as np

from parc_jax.certify.evaluate import Evaluation, anchor, evaluate
from parc_jax.certify.scene import Scene
from parc_jax.model import TrajectoryModel


class Points(NamedTuple):
    """Points with everything known of them; leading axis b.

    p0 (b, n_p), k (b, n_k), path (b, T + 1, n_p), clearance (b,), bin (b,), pattern (b, n_hidden) bool.
    cell (b,): an integer per region and bin, equal for points that share both (bytes of pattern and bin).
    """

    p0: np.ndarray
    k: np.ndarray
    path: np.ndarray
    clearance: np.ndarray
    bin: np.ndarray
    pattern: np.ndarray
    cell: np.ndarray

    def at(self, index) -> "Points":
        """The points of an index array or mask."""
        return Points(*(field[index] for field in self))


class Draw(NamedTuple):
    """One batch: how many points were drawn, how many reach the goal in the model, and the safe ones."""

    drawn: int
    reaching: int
    safe: Points


def draw(model: TrajectoryModel, scene: Scene, rng: np.random.Generator, n: int) -> Draw:
    """Draw k uniform in K and the end point uniform in the goal's box, n times; p0 follows. Volume preserving."""
    k = rng.uniform(model.domain.lo, model.domain.hi, (n, model.n_k))
    z = rng.uniform(scene.z_lo, scene.z_hi, (n, model.n_p))
    p0, reaches = anchor(model, scene, z, k)
    p0, k = p0[reaches], k[reaches]
    e = evaluate(model, scene, p0, k)
    return Draw(n, len(k), points(p0, k, e).at(e.safe))


def points(p0: np.ndarray, k: np.ndarray, e: Evaluation) -> Points:
    """Collect evaluated points and name their cells."""
    return Points(p0, k, e.path, e.clearance, e.bin, e.pattern, cell_of(e.pattern, e.bin))


def cell_of(pattern: np.ndarray, bin_number: np.ndarray) -> np.ndarray:
    """(b,) byte strings that are equal exactly when pattern (b, n_hidden) and bin (b,) are."""
    packed = np.packbits(pattern, axis=1)
    number = np.ascontiguousarray(bin_number, dtype="<i4").view(np.uint8).reshape(len(packed), 4)
    joined = np.ascontiguousarray(np.concatenate([packed, number], axis=1))
    return joined.view(f"V{joined.shape[1]}")[:, 0]


def groups(cells: np.ndarray):
    """Pairs (cell bytes, indices) of equal cells."""
    if len(cells) == 0:
        return []
    order = np.argsort(cells, kind="stable")
    ranked = cells[order]
    cut = np.flatnonzero(ranked[1:] != ranked[:-1]) + 1
    return [(cells[index[0]].tobytes(), index) for index in np.split(order, cut)]


def generator(key: jax.Array) -> np.random.Generator:
    """A host generator seeded by all bits of a JAX key: draws are cheap and the key still decides everything."""
    words = np.asarray(jax.random.key_data(key) if jax.dtypes.issubdtype(key.dtype, jax.dtypes.prng_key) else key)
    return np.random.default_rng([int(w) for w in words.ravel()])
