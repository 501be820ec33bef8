"""The main job's settings for the slot."""

from parc_jax.app.study.settings import Study

STUDY = Study(
    hidden=(8, 8, 8),
    bins=(2, 3, 1),
    rollouts=4000,
    profile_runs=8000,
    fresh=14_000,
    work=0.1,  # a tenth of the standard: corridors hold 94 % and more
    repeats=10,
)
