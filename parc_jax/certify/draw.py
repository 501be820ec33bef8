"""Points of the goal-reaching set, drawn without rejection and without a search over regions. [T15]"""

from typing import NamedTuple

import jax
import numpy as np

from parc_jax.certify.evaluate import Evaluation
from parc_jax.certify.scene import Scene
from parc_jax.certify.screen import screen
from parc_jax.model import TrajectoryModel

NEAREST, FARTHEST = 0.003, 0.1  # [size of K, size of the goal] spread of `near`


class Points(NamedTuple):
    """Points with everything known of them; leading axis b.

    p0 (b, n_p), k (b, n_k), path (b, T + 1, n_p), bin (b,), pattern (b, n_hidden) bool.
    cell (b,): an integer per region and bin, equal for points that share both (bytes of pattern and bin).
    """

    p0: np.ndarray
    k: np.ndarray
    path: np.ndarray
    bin: np.ndarray
    pattern: np.ndarray
    cell: np.ndarray

    def at(self, index) -> "Points":
        """The points of an index array or mask."""
        return Points(*(field[index] for field in self))


class Draw(NamedTuple):
    """One batch: how many points were drawn, how many reach the goal in the model, and the safe ones.

    volume: of the set they are uniform over, in units of p0 and k multiplied; it holds every (p0, k) that reaches.
    """

    drawn: int
    reaching: int
    safe: Points
    volume: float


def draw(model: TrajectoryModel, scene: Scene, rng: np.random.Generator, n: int) -> Draw:
    """n points (z, k), uniform over bin x (the goal's box less the bin's final error) for all bins of the tube.

    z is where the plan ends in the model; p0 = z - c_f(k) follows. Volumes of (z, k) are volumes of (p0, k). [T15]
    """
    boxes = [model.tube.bin_box(b) for b in range(model.tube.n_bins)]
    k_lo, k_hi = np.array([lo for lo, _ in boxes]), np.array([hi for _, hi in boxes])
    error = model.tube.final[:, : model.n_p]
    z_lo, z_hi = scene.z_lo + error, scene.z_hi - error
    with np.errstate(invalid="ignore"):  # a bin without claim has an infinite error and no room at all
        room = np.where((z_lo < z_hi).all(axis=1), np.prod(z_hi - z_lo, axis=1), 0.0)
    size = room * np.prod(k_hi - k_lo, axis=1)
    whole = float(size.sum())
    if whole == 0:
        return Draw(n, 0, _no_points(model), 0.0)
    b = rng.choice(len(size), n, p=size / whole)
    k = rng.uniform(k_lo[b], k_hi[b])
    reaching, safe, (p0, path, pattern, number) = screen(model, scene, rng.uniform(z_lo[b], z_hi[b]), k)
    return Draw(n, reaching, Points(p0, k[safe], path, number, pattern, cell_of(pattern, number)), whole)


def near(model: TrajectoryModel, scene: Scene, rng: np.random.Generator, around: Points, n: int) -> Points:
    """Safe ones among n points of no particular law, close to the given ones: to look where uniform draws miss."""
    to = rng.integers(0, len(around.k), n)
    size = np.exp(rng.uniform(np.log(NEAREST), np.log(FARTHEST), (n, 1)))
    k = around.k[to] + size * (scene.k_hi - scene.k_lo) * rng.standard_normal((n, model.n_k))
    z = around.path[to, -1] + size * (scene.z_hi - scene.z_lo) * rng.standard_normal((n, model.n_p))
    known = ((k > scene.k_lo) & (k < scene.k_hi)).all(axis=1)
    if not known.any():
        return _no_points(model)
    k, z = k[known], z[known]
    _, safe, (p0, path, pattern, number) = screen(model, scene, z, k)
    return Points(p0, k[safe], path, number, pattern, cell_of(pattern, number))


def _no_points(model: TrajectoryModel) -> Points:
    pattern, number = np.zeros((0, sum(model.net.hidden)), bool), np.zeros(0, int)
    path = np.zeros((0, model.time.n_steps + 1, model.n_p))
    p0, k = np.zeros((0, model.n_p)), np.zeros((0, model.n_k))
    return Points(p0, k, path, number, pattern, cell_of(pattern, number))


def points(p0: np.ndarray, k: np.ndarray, e: Evaluation) -> Points:
    """Collect evaluated points and name their cells."""
    return Points(p0, k, e.path, e.bin, e.pattern, cell_of(e.pattern, e.bin))


def joined(parts: list[Points]) -> Points:
    """All points of several batches, in order."""
    return Points(*(np.concatenate(fields) for fields in zip(*parts, strict=True)))


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
