"""Fresh draws, one after another: as many plans as the looks of a search need, drawn while the search is at work."""

from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from parc_jax.certify.draw import Draw, Points, draw, joined
from parc_jax.certify.scene import Scene
from parc_jax.model import TrajectoryModel

FIRST_DRAW = 512
LARGEST_DRAW = 2**18
HOPELESS = 50_000  # drawn without a safe one: other means have to decide whether there is any
SOME = 100  # safe plans seen before a draw may be as large as it wants
ENOUGH = 6000  # fresh safe plans of a look: a share a little below a target of 1 % is then told from it
REMEMBERED = 60_000  # safe plans kept, the last ones: a uniform sample of the safe set, whose paths take memory


class Draws:
    """Draws from a thread of their own, which depend on nothing but `rng`. Use in a `with` statement.

    drawn, reaching, safe: counts over all that were taken; volume: of the set they are uniform over.
    """

    def __init__(self, model: TrajectoryModel, scene: Scene, rng: np.random.Generator):
        self._model, self._scene, self._rng = model, scene, rng
        self.drawn = self.reaching = self.safe = 0
        self.volume = 0.0
        self._seen: list[Points] = []
        self._thread = ThreadPoolExecutor(1)
        self._coming: Future[Draw] | None = None

    def __enter__(self) -> "Draws":
        return self

    def __exit__(self, *_) -> None:
        self._thread.shutdown()

    def start(self) -> None:
        """Begin the next draw: so many that ENOUGH of them should be safe."""
        most = LARGEST_DRAW if self.safe >= SOME else LARGEST_DRAW // 4
        size = int(np.clip(ENOUGH * self.drawn / max(self.safe, 1), FIRST_DRAW, most))
        self._coming = self._thread.submit(draw, self._model, self._scene, self._rng, size)

    def take(self) -> Points:
        """The safe plans of the draw that was started, or of one made now."""
        if self._coming is None:
            self.start()
        batch, self._coming = self._coming.result(), None
        self.drawn, self.reaching = self.drawn + batch.drawn, self.reaching + batch.reaching
        self.safe, self.volume = self.safe + len(batch.safe.k), batch.volume
        self._seen.append(batch.safe)
        while sum(len(s.k) for s in self._seen[1:]) > REMEMBERED:
            self._seen.pop(0)
        return batch.safe

    @property
    def seen(self) -> Points:
        """The last safe plans taken."""
        return joined(self._seen)

    @property
    def hopeless(self) -> bool:
        """So many drawn, and none was safe."""
        return self.safe == 0 and self.drawn >= HOPELESS
