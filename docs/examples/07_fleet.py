"""Door 2 with a fleet: a black box in plain Python on whatever is a `concurrent.futures.Executor`.

Its runs depend on their rows alone; one that is lost with its worker has failed, unless
lost="again" says that workers go away, and a worker that holds another program is refused.
"""

from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import jax
import numpy as np

import parc_jax as pj


def glide(rng, k):
    """Drives k = (x, y) in a second, in a gust."""
    s = np.linspace(0.0, 1.0, 21)[:, None]
    return s * k + s**2 * 0.02 * rng.normal(size=2), []


if __name__ == "__main__":
    # a function that makes one, so that another can take the place of one that broke; dask, whose
    # workers come and go: executor=Client("tcp://...").get_executor(), workers=200, lost="again"
    make = partial(ProcessPoolExecutor, 2, mp_context=get_context("spawn"))
    domain, time = pj.box([0.5, -0.5], [1.0, 0.5]), pj.learning.time_grid(0.25, 1.0, 0.05)
    glider = pj.python_system(glide, domain, time, name="glider", n_p=2, executor=make)

    key = jax.random.PRNGKey(0)
    runs = pj.learning.collect(glider, key, n=400, quiet=True)
    net = pj.learning.train(runs, hidden=(8,), key=key, seeds=2, steps=400)
    claim = pj.learning.bound_error(net, glider, key, eps=0.05, delta=0.05, train=runs, quiet=True)
    scene = pj.reach_avoid(pj.box([0.7, -0.3], [1.3, 0.3]), [pj.box([0.2, 0.25], [0.5, 0.5])], 0.1)
    answer = pj.Planner(pj.learning.trajectory_model(net, claim)).solve(
        scene, key, pj.Settings.fast()
    )
    print(answer.details())
    glider.close()
