"""Any system that parc_jax takes is a box: its runs move along with their start."""

from pathlib import Path

import numpy as np
import pytest
from needs import need

import parc_jax as pj
from benchmarks.suite.boxes.robots import of_system

DOMAIN, TIME = pj.box([0.5, -0.5], [0.9, 0.5]), pj.learning.time_grid(0.25, 1.0, 0.05)
HELPERS = Path(__file__).parents[2] / "helpers"


def glide(rng, k):
    """p, q of a glider in a gust."""
    s = np.linspace(0.0, 1.0, 21)[:, None]
    return s * k + s**2 * rng.normal(0.0, 0.02, 2), k[1:]


def moved(box):
    """Runs of one k from two places, after what every box promises was seen to hold."""
    p0, k = np.array([[0.0, 0.0], [2.0, -1.0]]), np.full((2, 2), [0.7, 0.2])
    p, q = box.rollout(p0, k, 3)
    assert p.shape == (2, box.records * box.fine + 1, 1, 2) and q.shape == (2, len(box.q))
    assert np.allclose(p[:, 0, 0], p0)
    assert (box.rollout(p0, k, 3)[0] == p).all() and (box.rollout(p0, k, 4)[0] != p).any()
    return p


def test_a_python_system_is_a_box():
    system = pj.python_system(glide, DOMAIN, TIME, name="glider", n_p=2, n_q=1, workers=0)
    box = of_system("yours.box", system, 5)
    assert (box.records, box.dt, box.k_lo, box.fine) == (4, 0.25, (0.5, -0.5), 5)
    ends = moved(box)[:, -1, 0]
    assert np.abs(ends - [[0.7, 0.2], [2.7, -0.8]]).max() < 0.1
    system.close()


@pytest.mark.night
def test_an_fmu_is_a_box(tmp_path):
    need("fmpy", "pythonfmu")
    from pythonfmu import FmuBuilder

    path = FmuBuilder.build_FMU(HELPERS / "glider_fmu.py", dest=tmp_path)
    about = {"q": ("heading",), "seed": "seed", "workers": 0}
    system = pj.learning.fmu_system(path, ("vx", "vy"), ("x", "y"), DOMAIN, TIME, **about)
    ends = moved(of_system("yours.box", system))[:, -1, 0]
    assert np.abs(ends - [[0.7, 0.2], [2.7, -0.8]]).max() < 0.1
    system.close()
