"""A system of the user's own in plain Python, as the shell finds it by its module name."""

from walkers import walk

import parc_jax as pj


def system(plant="plain"):
    """The one that walks at random; or one that drifts by another law."""
    law = {"plain": {}, "windy": {"wind": 1.0}}[plant]
    domain, time = pj.box([0.0], [1.0]), pj.learning.time_grid(0.5, 1.0)
    return pj.python_system(walk, domain, time, name="walk", n_p=2, n_q=1, workers=0, law=law)
