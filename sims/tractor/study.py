"""The main job's settings for the tractor."""

from parc_jax.app.study.settings import Study

STUDY = Study(hidden=(8, 8, 8), bins=(2, 2), rollouts=1000, eps=0.05, delta=0.05)
