"""The main job's settings for the car; docs/kerb.md says how they were chosen."""

from parc_jax.app.study.settings import Study

STUDY = Study(
    hidden=(8, 8, 8),
    bins=(2, 2),
    rollouts=2_000,
    eps=2e-3,
)
