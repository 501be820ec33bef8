"""The car as a black box: repeatable by key at any thread count, the same everywhere, and really
drifting.
"""

from dataclasses import fields, replace

import numpy as np
import pytest
from drawn_keys import drawn_keys

import sims
from parc_jax.common.errors import InputError
from parc_jax.learning.runs.law import law_of
from sims.f110 import params as c
from sims.f110 import problem
from sims.f110.disturbance import LAWS, draw
from sims.f110.scenario import GOAL_SIZE, SPACE

pytestmark = pytest.mark.slow  # runs of its own: of the gate

KEYS = drawn_keys(5, 24)
CORNERS = [(y, v) for y in c.LINE_RANGE for v in c.SPEED_RANGE]


@pytest.fixture(scope="module")
def system():
    return sims.load("f110", threads=2)


@pytest.fixture(scope="module")
def ks(system):
    lo, hi = np.asarray(system.domain.lo), np.asarray(system.domain.hi)
    return np.concatenate([CORNERS, lo + (hi - lo) * np.random.default_rng(2).random((20, 2))])


@pytest.fixture(scope="module")
def run(system, ks):
    return system.run(KEYS, ks)


@pytest.mark.night
def test_repeatable_to_the_bit_at_any_thread_count(system, ks, run):
    np.testing.assert_array_equal(replace(system, threads=1).run(KEYS, ks).measured, run.measured)


def test_a_run_does_not_depend_on_its_neighbours(system, ks, run):
    for i in (0, 7):
        np.testing.assert_array_equal(
            system.run(KEYS[i : i + 1], ks[i : i + 1]).measured[0], run.measured[i]
        )
    one = system.rollout(KEYS[7], ks[7])
    np.testing.assert_array_equal(one.p, run.measured[7, :, :2] - run.measured[7, :1, :2])


def test_another_key_is_another_run(system, ks, run):
    other = system.run(KEYS[::-1][:4], ks[:4])
    assert np.abs(other.pose[:, -1] - run.pose[:4, -1]).max(axis=1).min() > 1e-3


def test_without_disturbance_the_key_does_not_matter(ks):
    quiet = sims.load("f110", law="none")
    a, b = (quiet.run(keys, ks[:3]).measured for keys in (KEYS[:3], KEYS[3:6]))
    np.testing.assert_array_equal(a, b)
    with pytest.raises(InputError, match="floor, none"):
        sims.load("f110", law="ice")


def test_the_same_run_elsewhere(system, ks, run):
    """Up to the rounding of larger coordinates, which a slide of two seconds amplifies."""
    moved = system.run(KEYS[:4], ks[:4], origin=(37.0, -11.0))
    np.testing.assert_allclose(
        moved.pose[:, :, :2] - [37.0, -11.0], run.pose[:4, :, :2], rtol=0, atol=1e-6
    )
    np.testing.assert_allclose(moved.pose[:, :, 2], run.pose[:4, :, 2], rtol=0, atol=1e-6)


def test_the_family_drifts_turns_about_and_stops(run):
    peak = np.rad2deg(np.abs(run.sideslip).max(axis=1))
    assert peak.min() > 30
    assert np.abs(run.pose[:, -1, 2] - np.pi).max() < np.pi / 3
    assert np.abs(run.velocity[:, -1, :2]).max() < 0.05
    assert (run.switched < 3.5).all()


def test_the_family_lands_around_the_space(run):
    middle = (run.pose[:, -1, :2].max(axis=0) + run.pose[:, -1, :2].min(axis=0)) / 2
    assert np.abs(middle - SPACE).max() < 0.2


def test_it_follows_the_line_at_the_speed_first(run, ks):
    at = np.round(run.switched / c.TICK).astype(int) - 4
    rows = np.arange(len(ks))
    assert np.abs(run.pose[rows, at, 1] - ks[:, 0]).max() < 0.12
    assert np.abs(np.hypot(*run.velocity[rows, at, :2].T) - ks[:, 1]).max() < 0.3


def test_draws_keep_inside_the_declared_law():
    law = LAWS["floor"]
    drawn = draw(law, drawn_keys(0, 500), 2)
    for name in ("friction", "motor", "battery", "mass", "steering", "latency"):
        lo, hi = getattr(law, name)
        values = getattr(drawn, name)
        assert values.min() >= lo and values.max() <= hi and np.ptp(values) > 0.95 * (hi - lo)
    assert drawn.patches.shape == (500, law.patches, 4)
    assert np.abs(drawn.noise).max(axis=(0, 1)) == pytest.approx([0.0017, 0.0017, 0.0068], rel=0.4)


def test_the_law_is_declared(system):
    declared = dict(law_of(system).parameters)
    assert set(declared) == {f.name for f in fields(system.law)}
    assert law_of(system).hash != law_of(sims.load("f110", law="none")).hash


def test_the_space_fits_one_car():
    scene = problem()
    assert len(scene.obstacles) == 2
    free = c.GAP - 2 * scene.body.radius
    assert free == pytest.approx(GOAL_SIZE[0], abs=0.005)
