"""The main job's settings for the robot."""

from parc_jax.app.study.settings import Study
from parc_jax.learning.bound.settings import ModelBound

STUDY = Study(
    hidden=(8, 8),
    rollouts=6_000,
    bound=ModelBound(bins=(2, 1, 2, 1), eps=1e-2, delta=1e-3),
)
