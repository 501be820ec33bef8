"""Settings: sixty training runs, as for a car that somebody has to carry back to the start; the
study is `job`.
"""

from parc_jax.app.study.settings import Study

STUDY = Study(
    hidden=(8, 8, 8),
    bins=(1, 1),
    rollouts=60,
    eps=0.05,
    delta=0.05,
)
