"""The main job's settings for the drone."""

from parc_jax.app.study.settings import Study
from parc_jax.learning.bound.settings import ModelBound

BOUND = ModelBound(bins=(1, 1, 1), eps=0.05, delta=0.05)
STUDY = Study(hidden=(8, 8), rollouts=1000, bound=BOUND, risk=0.01)
