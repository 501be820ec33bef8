"""A profile from training runs alone."""

from parc_jax.common.tolerances import TOLERANCES
from parc_jax.learning.bound.profile import profile_of, training_errors


def training_profile(net, train, bins=None, floor=TOLERANCES.profile_floor):
    """As learnt from the finite ones of these runs."""
    k, errors = training_errors(net, train)
    return profile_of(k, errors, train.domain, bins, len(train.points), floor)
