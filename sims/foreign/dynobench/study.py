"""The main job's settings for dynobench's first unicycle."""

from parc_jax.app.study.settings import Study

STUDY = Study(
    hidden=(16, 16),
    bins=(1, 1, 1),
    rollouts=4_000,
    eps=1e-2,
)
