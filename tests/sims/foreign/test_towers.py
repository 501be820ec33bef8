"""The aeroplane of JSBSim: the map against JSBSim's own, flights that repeat bit for bit, and what
moves with the start, found and refused.
"""

import importlib.util

import jax
import numpy as np
import pytest

import sims
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.start_gap import try_starts
from sims.foreign.towers import chart
from sims.foreign.towers import params as c
from sims.foreign.towers.flight import FOOT

NEEDED = pytest.mark.needs("jsbsim")
K = (27.5, 3.5, 6.5)


@pytest.fixture(scope="module")
def flight():
    """p (201, 5, 2), q (1,) of one flight."""
    from sims.foreign.towers.flight import fly

    return fly(np.random.default_rng(3), K)


@pytest.mark.night
@NEEDED
def test_flights_repeat_bit_for_bit_and_differ_by_the_turbulence(flight):
    from sims.foreign.towers.flight import fly

    again, other = fly(np.random.default_rng(3), K), fly(np.random.default_rng(4), K)
    np.testing.assert_array_equal(flight[0], again[0])
    np.testing.assert_array_equal(flight[1], again[1])
    assert 0.5 < abs(flight[0] - other[0]).max() < 40.0  # [m]


@pytest.mark.night
@NEEDED
def test_the_map_agrees_with_the_distances_that_jsbsim_counts_itself():
    from sims.foreign.towers.flight import flown, points, trimmed

    aeroplane = trimmed(np.zeros(2), c.ALTITUDE)
    names = ("position/from-start-neu-n-ft", "position/from-start-neu-e-ft")
    began = [aeroplane[name] for name in names]
    rows = flown(aeroplane, K)
    north, east = ((aeroplane[name] - was) * FOOT for name, was in zip(names, began, strict=True))
    centre = chart.on_map(rows[:, 6:] * FOOT)
    np.testing.assert_allclose(centre[-1] - centre[0], [east, north], atol=0.005)  # of 1.1 km
    assert points(rows).shape == (201, 5, 2)


def test_a_place_on_the_map_is_where_it_says():
    here = chart.place_of(np.zeros(2))
    there = chart.place_of(np.array([3000.0, -2000.0]))

    def earth(latitude, longitude):
        squared = chart.FLATTENING * (2 - chart.FLATTENING)
        across = chart.EQUATOR / np.sqrt(1 - squared * np.sin(latitude) ** 2)
        out = np.array(
            [np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), 0]
        )
        out[2] = (1 - squared) * np.sin(latitude)
        return across * out

    moved = chart.on_map(earth(*there[:2])) - chart.on_map(earth(*here[:2]))
    np.testing.assert_allclose(moved, [3000.0, -2000.0], atol=2.0)  # the map is flat, the earth not
    assert here[2] == 0.0 and there[2] > 0.0


@NEEDED
@pytest.mark.night
def test_the_start_matters_and_a_gap_too_small_is_refused():
    aeroplane = sims.load("towers", workers=0)
    key = jax.random.PRNGKey(0)
    with pytest.raises(InputError, match=r"moved the offsets by 0\.\d+ m"):
        try_starts(aeroplane, key, 1e-5)
    tried = try_starts(aeroplane, key, sims.towers.STUDY.bound.gap)
    assert 0.01 < tried.seen <= sims.towers.STUDY.bound.gap


@pytest.mark.night
@NEEDED
def test_runs_through_the_public_door_have_their_points():
    import parc_jax as pj

    runs = pj.learning.collect(
        sims.load("towers", workers=0), jax.random.PRNGKey(1), n=3, quiet=True
    )
    assert runs.p.shape == (3, 201, 10) and not runs.failed.any()
    assert (runs.p[:, 0, :2] == 0).all() and len(np.unique(runs.q)) == 3


def test_without_the_package_the_line_that_installs_it_is_said(monkeypatch):
    real = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "jsbsim" else real(name)
    )
    with pytest.raises(InputError, match=r"pip install 'parc_jax\[flight\]'"):
        sims.load("towers")
