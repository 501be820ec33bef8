"""The main job's settings for the slot."""

from parc_jax.app.study.settings import Study
from parc_jax.learning.bound.settings import ModelBound
from parc_jax.safe_set.settings import Settings

STUDY = Study(
    hidden=(8, 8, 8),
    rollouts=4000,
    bound=ModelBound(bins=(2, 3, 1), profile_runs=8000, fresh=14_000),
    # a tenth of the standard work: corridors hold 94 % and more
    settings=Settings(work=0.1),
    repeats=10,
)
