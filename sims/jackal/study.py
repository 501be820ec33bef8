"""The main job's settings for the robot."""

from parc_jax.app.study.settings import Study

STUDY = Study(
    hidden=(8, 8),
    bins=(2, 1, 2, 1),
    rollouts=6_000,
    eps=1e-2,
    delta=1e-3,
)
