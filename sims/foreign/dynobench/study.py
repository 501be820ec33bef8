"""The main job's settings for dynobench's first unicycle."""

from parc_jax.app.study.settings import Study
from parc_jax.learning.bound.settings import ModelBound

STUDY = Study(
    hidden=(16, 16),
    rollouts=4_000,
    bound=ModelBound(bins=(1, 1, 1), eps=1e-2),
)
