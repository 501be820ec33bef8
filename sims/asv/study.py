"""The main job's settings for the boat; docs/asv.md says how they were chosen."""

from parc_jax.app.study.settings import Study
from parc_jax.learning.bound.settings import ModelBound

STUDY = Study(
    hidden=(8, 8, 8, 8),
    rollouts=65_000,  # for the networks, and for the profile once more: the holdout judges both
    bound=ModelBound(
        bins=(6, 6, 6),  # in which the profile is learnt; a claim is about eight of them
        blocks=(3, 3, 3),
        shape="fitted",
        eps=1e-2,
        fresh=100_000,
    ),
    plant="ode",
    repeats=100,
)

# as many runs, with tubes of boxes: what the study was before
BOXES = STUDY.replace(
    bins=(3, 3, 3),
    blocks=(3, 3, 3),
    shape="box",
    rollouts=5_000,
    profile_runs=60_000,
    tail=8.0,
)

# ten times the motion per rollout, and hardly any spread: fewer runs, on the faster plant
PUBLISHED = BOXES.replace(fresh=None, profile_runs=10_000)
