"""Settings: sixty training runs, as for a car that somebody has to carry back to the start; the
study is `job`.
"""

from parc_jax.app.study.settings import Study
from parc_jax.learning.bound.settings import ModelBound

STUDY = Study(
    hidden=(8, 8, 8),
    rollouts=60,
    bound=ModelBound(bins=(1, 1), eps=0.05, delta=0.05),
)
