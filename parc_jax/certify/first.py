"""Safe plans without polytopes: what is drawn until there are enough, for a first look and a fast start."""

import time

import numpy as np

from parc_jax.certify.cover import Cover, nothing_covered
from parc_jax.certify.draw import draw, joined
from parc_jax.certify.draws import FIRST_DRAW, HOPELESS, LARGEST_DRAW
from parc_jax.certify.scene import Scene
from parc_jax.model import TrajectoryModel


def first_look(model: TrajectoryModel, scene: Scene, rng: np.random.Generator, n: int, confidence: float) -> Cover:
    """Draw until n points are safe, or until HOPELESS are drawn without one. Nothing is grown, nothing is covered."""
    begin, first = time.perf_counter(), None
    drawn = reaching = safe = 0
    seen, size = [], FIRST_DRAW
    while safe < n and not (safe == 0 and drawn >= HOPELESS):
        batch = draw(model, scene, rng, size)
        seen.append(batch.safe)
        drawn, reaching, safe = drawn + batch.drawn, reaching + batch.reaching, safe + len(batch.safe.k)
        if safe and first is None:
            first = time.perf_counter() - begin
        size = int(np.clip(1.2 * n * drawn / max(safe, 1), FIRST_DRAW, LARGEST_DRAW))
    none = nothing_covered(confidence)
    return Cover(drawn, reaching, safe, batch.volume, joined(seen), none, none, first_sample_s=first)
