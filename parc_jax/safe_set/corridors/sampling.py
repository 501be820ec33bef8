"""Random plans of the goal-reaching set, drawn without rejection or a search over regions. [T15]"""

from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager
from typing import NamedTuple

import numpy as np

from parc_jax.common.arrays import once
from parc_jax.common.shapes import ManyParams, Positions
from parc_jax.learning.bound.tube import Tube
from parc_jax.learning.model import TrajectoryModel
from parc_jax.learning.network.relu import outputs
from parc_jax.safe_set.verdict.pointwise import Verdicts
from parc_jax.safe_set.verdict.scene import Scene
from parc_jax.safe_set.verdict.screen import Screened, screen


class BinEnds(NamedTuple):
    """One box of k and one of ends per bin; a plan that reaches the goal is in one of these.

    k_lo, k_hi (n_bins, n_k), z_lo, z_hi (n_bins, n_p). volume (n_bins,): of both boxes together,
    nothing where no end fits or nothing is claimed.
    """

    k_lo: np.ndarray
    k_hi: np.ndarray
    z_lo: np.ndarray
    z_hi: np.ndarray
    volume: np.ndarray


def ends_of(scene: Scene) -> BinEnds:
    """The ends that the goal of a scene allows, and the part of each bin that it asks for."""
    k_lo, k_hi, least, most = once(scene.model.tube, _about)
    k_lo = np.maximum(k_lo, scene.k_lo)
    k_hi = np.maximum(np.minimum(k_hi, scene.k_hi), k_lo)
    z_lo, z_hi = scene.z_lo - least, scene.z_hi - most
    with np.errstate(invalid="ignore"):  # a bin without claim has an infinite error: no ends at all
        ends = np.where((z_lo < z_hi).all(axis=1), np.prod(z_hi - z_lo, axis=1), 0.0)
    return BinEnds(k_lo, k_hi, z_lo, z_hi, ends * np.prod(k_hi - k_lo, axis=1))


def _about(tube: Tube) -> tuple:
    """The part independent of the scene: corners of the bins, extent of the errors at the end."""
    boxes = [tube.bin_box(b) for b in range(tube.n_bins)]
    return *map(np.array, zip(*boxes, strict=True)), *tube.end_extent


NEAREST, FARTHEST = 0.003, 0.1  # [size of K, size of the goal] spread of `near`
FIRST_DRAW = 512
LARGEST_DRAW = 2**18
HOPELESS = 50_000  # drawn with fewer safe ones than FEW: other means have to look for them
RARE_DRAW = 8192  # at most while hardly any was safe: seconds are looked at between draws
FEW = 10  # a look of ENOUGH safe ones would take 10^8 draws and more
SOME = 100  # safe plans seen before a draw may be as large as it wants
# fresh safe plans of a look that may end a search: three quarters of a 1 % target are told from it;
# fewer cost more looks, and the corridors that are built meanwhile
ENOUGH = 16_000
EXPLORING = 2000  # of any other, which only says where to build
# safe plans kept, of each look and in all, the last ones: a uniform sample of the safe set, whose
# paths take memory
KEPT, REMEMBERED = 6000, 60_000


class Points(NamedTuple):
    """Plans with their predictions; leading axis b.

    p0 (b, n_p), k (b, n_k), path (b, T + 1, n_c), bin (b,) int64, pattern (b, n_hidden) bool.
    """

    p0: np.ndarray
    k: np.ndarray
    path: np.ndarray
    bin: np.ndarray
    pattern: np.ndarray

    def at(self, index: np.ndarray | slice | int) -> "Points":
        """The points of an index or mask."""
        return Points(*(field[index] for field in self))


ROOM = 0.25  # of its sides that a box around some points is longer, at either end
LEAST_ROOM = 1e-9  # [sides of the whole] the same, at least


class Place(NamedTuple):
    """A proposal region, to draw from instead of everywhere: all middle + axes u with |u_i| <= 1 in
    the space of (z, k), predicted ends of the first point and parameters, or of k alone where all
    plans have one start. middle (n,), axes (n, n) in columns; n = n_p + n_k, or n_k.
    """

    middle: np.ndarray
    axes: np.ndarray

    @property
    def volume(self) -> float:
        """In units of p0 and k multiplied."""
        return float(2.0 ** len(self.middle) * abs(np.linalg.det(self.axes)))

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners lo, hi (n,) of the box around it."""
        half = np.abs(self.axes).sum(axis=1)
        return self.middle - half, self.middle + half

    def draw(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """(n, n_p + n_k) or (n, n_k) uniform."""
        return self.middle + rng.uniform(-1, 1, (n, len(self.middle))) @ self.axes.T


def place_around(x: np.ndarray, lo: np.ndarray, hi: np.ndarray) -> Place:
    """A place around points x (b, n), with room, along their principal axes when the sides of the
    whole box lo, hi (n,) have length one.
    """
    sides = np.where(hi > lo, hi - lo, 1.0)
    unit = (x - x.mean(axis=0)) / sides
    _, _, directions = np.linalg.svd(unit, full_matrices=True)
    along = unit @ directions.T
    least, most = along.min(axis=0), along.max(axis=0)
    half = 0.5 * (most - least) * (1 + 2 * ROOM) + LEAST_ROOM
    middle = 0.5 * (least + most) @ directions
    return Place(x.mean(axis=0) + sides * middle, sides[:, None] * directions.T * half)


class Draw(NamedTuple):
    """One batch of draws: number of plans, number that reach the goal in the model, the safe ones.

    volume: of the set they are uniform over, in units of p0 and k multiplied; it contains every
    (p0, k) that reaches, unless a proposal region was given.
    """

    drawn: int
    reaching: int
    safe: Points
    volume: float


def draw(scene: Scene, rng: np.random.Generator, n: int, within: Place | None = None) -> Draw:
    """n points (z, k) as of `proposed`, and which of them are safe."""
    z, k, whole = proposed(scene, rng, n, within)
    if not len(k):
        return Draw(n, 0, no_points(scene.model), whole)
    seen, safe = safe_ones(scene, z, k)
    return Draw(n, seen.reaching, safe, whole)


def proposed(
    scene: Scene, rng: np.random.Generator, n: int, within: Place | None = None
) -> tuple[np.ndarray, np.ndarray, float]:
    """n points (z, k), uniform over bin x (the goal's box less the bin's final error) for all bins
    of the tube; or over a place, of which the plans that end elsewhere do not reach. Also the
    volume that they are uniform over: of nothing, no points.

    z is where the first point ends in the model; p0 = z - c_f(k) follows. Volumes of (z, k) are
    volumes of (p0, k). [T15] Where all plans have one start, k is uniform on K: volumes of k.
    """
    model = scene.model
    k_lo, k_hi, z_lo, z_hi, volume = ends_of(scene)
    if within is not None:
        x = within.draw(rng, n)
        k = x[:, -model.n_k :]
        z = x[:, : model.n_p] if scene.at is None else ends_from(scene.at, model, k)
        b = model.tube.bin_of(k)
        fits = (b >= 0) & ((z_lo[b] <= z) & (z <= z_hi[b])).all(axis=1)
        return z[fits], k[fits], within.volume
    if scene.at is not None:
        k = rng.uniform(scene.k_lo, scene.k_hi, (n, model.n_k))
        return ends_from(scene.at, model, k), k, float(np.prod(scene.k_hi - scene.k_lo))
    whole = float(volume.sum())
    b = rng.choice(len(volume), n if whole else 0, p=volume / whole if whole else None)
    k = rng.uniform(k_lo[b], k_hi[b])
    return rng.uniform(z_lo[b], z_hi[b]), k, whole


class Counts(NamedTuple):
    """Counts over draws: drawn, reaching in the model, safe. volume: of the set drawn from."""

    drawn: int = 0
    reaching: int = 0
    safe: int = 0
    volume: float = 0.0

    def plus(self, one: Draw) -> "Counts":
        """With one draw more."""
        reaching, safe = self.reaching + one.reaching, self.safe + len(one.safe.k)
        return Counts(self.drawn + one.drawn, reaching, safe, one.volume)

    @property
    def hopeless(self) -> bool:
        """So many drawn, and hardly any was safe."""
        return self.safe < FEW and self.drawn >= HOPELESS


class Sampler(AbstractContextManager):
    """Fresh draws, one after another, each made by another thread while the search is at work: as
    many plans as a look needs. They depend on nothing but `rng`. Use in a `with` statement.

    within: proposal region. tally: counts over all draws taken.
    """

    def __init__(self, scene: Scene, rng: np.random.Generator, within: Place | None = None):
        self._scene = scene
        self._rng = rng
        self._within = within
        self.tally = Counts()
        self._seen: list[Points] = []
        self._thread = ThreadPoolExecutor(1)
        self._coming: Future[Draw] | None = None

    def __exit__(self, *_) -> None:
        self._thread.shutdown()

    def start(self, enough: int = EXPLORING) -> None:
        """Begin the next draw: so many that `enough` of them should be safe."""
        drawn, safe = self.tally.drawn, self.tally.safe
        most = LARGEST_DRAW if safe >= SOME else LARGEST_DRAW // 4
        size = int(np.clip(enough * drawn / max(safe, 1), FIRST_DRAW, most))
        self._coming = self._thread.submit(draw, self._scene, self._rng, size, self._within)

    def take(self) -> Points:
        """The safe plans of the draw that was started, or of one made now."""
        if self._coming is None:
            self.start()
        one = self._coming.result()
        self._coming = None
        self.tally = self.tally.plus(one)
        self._seen.append(one.safe.at(np.arange(min(len(one.safe.k), KEPT))))
        while sum(len(s.k) for s in self._seen[1:]) > REMEMBERED:
            self._seen.pop(0)
        return one.safe

    @property
    def seen(self) -> Points:
        """The last safe plans taken."""
        return joined(self._seen)


def near(scene: Scene, rng: np.random.Generator, around: Points, n: int) -> Points:
    """Safe ones among n points of no particular law near given ones, where uniform draws miss."""
    model = scene.model
    to = rng.integers(0, len(around.k), n)
    size = np.exp(rng.uniform(np.log(NEAREST), np.log(FARTHEST), (n, 1)))
    k = around.k[to] + size * (scene.k_hi - scene.k_lo) * rng.standard_normal((n, model.n_k))
    ends = around.path[to, -1, : model.n_p]
    z = ends + size * (scene.z_hi - scene.z_lo) * rng.standard_normal((n, model.n_p))
    if scene.at is not None:
        z = ends_from(scene.at, model, k)
    known = ((k > scene.k_lo) & (k < scene.k_hi)).all(axis=1)
    return safe_ones(scene, z[known], k[known])[1]


def safe_ones(scene: Scene, z: Positions, k: ManyParams) -> tuple[Screened, Points]:
    """Screen plans with ends z (b, n_p) and parameters k (b, n_k): the result and the safe ones."""
    seen = screen(scene, z, k)
    # a start that is asked for is not the one that rounding makes of it; the slack pays for that
    p0 = seen.p0 if scene.at is None else np.tile(scene.at, (len(seen.p0), 1))
    return seen, points(p0, k[seen.row], seen)


def ends_from(start: np.ndarray | float, model: TrajectoryModel, k: np.ndarray) -> np.ndarray:
    """(b, n_p) where the first point ends that starts there, for parameters k (b, n_k)."""
    first = model.layout.n_offsets - model.n_c
    return start + outputs(model.net, k, slice(first, first + model.n_p))


def plans_of(scene: Scene, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """p0 (b, n_p), k (b, n_k) of ends and parameters x, or of parameters from the one start."""
    model, k = scene.model, x[:, -scene.model.n_k :]
    if scene.at is not None:
        return np.tile(scene.at, (len(k), 1)), k
    return x[:, : model.n_p] - ends_from(0.0, model, k), k


def box_of_plans(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Corners (n,) of the box of all ends and parameters, or of parameters from the one start."""
    if scene.at is not None:
        return scene.k_lo, scene.k_hi
    return np.r_[scene.z_lo, scene.k_lo], np.r_[scene.z_hi, scene.k_hi]


def no_points(model: TrajectoryModel) -> Points:
    """None at all."""
    pattern, bins = np.zeros((0, sum(model.net.hidden)), bool), np.zeros(0, np.int64)
    path = np.zeros((0, model.time.n_steps + 1, model.n_c))
    p0, k = np.zeros((0, model.n_p)), np.zeros((0, model.n_k))
    return Points(p0, k, path, bins, pattern)


def points(p0: np.ndarray, k: np.ndarray, e: Verdicts | Screened) -> Points:
    """Plans with their predictions."""
    # of one dtype, whoever counted the bins: for another one all that follows is compiled again
    return Points(p0, k, e.path, e.bin.astype(np.int64), e.pattern)


def joined(parts: list[Points]) -> Points:
    """All points of several batches, in order; paths are large, and not copied without need."""
    some = [part for part in parts if len(part.k)] or parts[:1]
    if len(some) == 1:
        return some[0]
    return Points(*(np.concatenate(fields) for fields in zip(*some, strict=True)))
