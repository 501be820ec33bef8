"""Toys against what is known of them; and any system that parc_jax takes is a box, whose runs move
along with their start.
"""

import numpy as np
import pytest
from scipy.stats import t as student

import parc_jax as pj
from benchmarks.suite.boxes import cushion, load, sled
from benchmarks.suite.boxes.robots import of_system

DOMAIN, TIME = pj.box([0.5, -0.5], [0.9, 0.5]), pj.learning.time_grid(0.25, 1.0, 0.05)


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


def test_the_tails_of_the_sled_are_those_of_another_program():
    u = np.linspace(sled.ENDS, 1 - sled.ENDS, 999)
    np.testing.assert_allclose(sled.spread(u), student.ppf(u, 3), atol=1e-9)
    assert np.isfinite(sled.spread(np.array([0.0, 1.0]))).all()


def test_the_sled_sticks_in_one_run_of_fifty_and_slips_by_how_far_it_goes():
    box, (nodes, weights) = load("sled"), load("sled").nodes
    k = np.tile([0.8, 0.0, 0.8, 0.0], (len(nodes), 1))
    p, _ = box.told(np.zeros((len(k), 2)), k, nodes)
    x, y = p[:, :, 0].T
    stuck = np.isclose(x[-1], 0.8 + 0.8 * (1 - sled.STUCK) * (1 - sled.DELAY * nodes[:, 0]))
    assert weights[stuck].sum() == pytest.approx(sled.STICKS) and weights.sum() == pytest.approx(1)
    np.testing.assert_allclose(y[10] * x[-1], y[-1] * x[10], atol=1e-9)


def test_a_puck_comes_back_from_the_cushion_and_is_never_behind_it():
    box = load("cushion")
    k = np.random.default_rng(0).uniform(box.k_lo, box.k_hi, (2000, 2))
    p, _ = box.rollout(np.zeros((2000, 2)), k, 0)
    y = p[:, :, 0, 1]
    assert y.max() <= cushion.WALL and (y[:, -1] < y.max(axis=1) - 0.05).mean() > 0.3
    near, _ = box.rollout(np.tile([0.0, 0.7], (2000, 1)), k, 0)
    assert np.abs((near - p)[:, -1, 0, 1] - 0.7).max() > 0.5  # where it begins matters


def test_a_python_system_is_a_box():
    system = pj.python_system(glide, DOMAIN, TIME, name="glider", n_p=2, n_q=1, workers=0)
    box = of_system("yours.box", system, 5)
    assert (box.records, box.dt, box.k_lo, box.fine) == (4, 0.25, (0.5, -0.5), 5)
    ends = moved(box)[:, -1, 0]
    assert np.abs(ends - [[0.7, 0.2], [2.7, -0.8]]).max() < 0.1
    system.close()
