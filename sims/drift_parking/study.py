"""The main job's settings for drift parking; docs/main_job.md says how they were chosen."""

from parc_jax.app.study.settings import Study
from parc_jax.learning.bound.settings import ModelBound
from sims import rectangle

STUDY = Study(
    body=rectangle.BODY,
    hidden=(8, 8, 8, 8),
    # the tube follows the jumps better: a safe set larger by a sixth to a half
    bound=ModelBound(bins=(20, 4), profile_runs=30_000),
    risk=0.003,  # of the validated set
    driven=True,
)
