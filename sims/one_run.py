"""One run of a black box that runs many at a time, outside of JAX."""

from typing import Any

import numpy as np

from parc_jax.learning.system import Trajectory


def one_run(system: Any, key, k) -> Trajectory:
    """The run of a key (2,) and parameters k (n_k,): a method `rollout` of systems in `sims`."""
    many = system.rollout_batch(np.asarray(key)[None], np.asarray(k)[None])
    return Trajectory(*(part[0] for part in many))
