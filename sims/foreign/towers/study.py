"""The main job's settings for the aeroplane; docs/towers.md says how they were chosen."""

from parc_jax.app.study.settings import Study
from parc_jax.learning.bound.settings import ModelBound

STUDY = Study(
    hidden=(8, 8, 8),
    rollouts=2_000,
    bound=ModelBound(bins=(1, 1, 1), eps=2e-3, gap=0.25),
)
