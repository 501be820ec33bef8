"""Plain Python systems: what they return is copied, failures are kept, and what never works is an
error.
"""

import functools
import sys

import jax
import numpy as np
import pytest

import parc_jax as pj
from parc_jax.common.errors import InputError
from parc_jax.learning.bound.start_gap import translation_gap
from parc_jax.learning.runs.collect import stream_rollouts
from parc_jax.learning.systems.python_system import python_system

DOMAIN, TIME = pj.box([0.0], [1.0]), pj.learning.time_grid(0.5, 1.0)
KEY = jax.random.PRNGKey(3)


def walk(rng, k):
    """A random walk with drift k, somewhere in the plane."""
    return 7.0 + np.concatenate(
        [np.zeros((1, 2)), np.cumsum(k[0] + rng.normal(size=(2, 2)), axis=0)]
    ), [k[0]]


def walk_from(rng, k, p0, pull=0.0):
    """The same from p0; with a pull, not the same."""
    p, q = walk(rng, k)
    return p + p0 + pull * p0 * np.linspace(0, 1, 3)[:, None], q


def broken(rng, k):
    """Never works."""
    return walk(rng, k)[0], []


def system(simulate, workers, **more):
    return python_system(simulate, DOMAIN, TIME, name="walk", n_p=2, n_q=1, workers=workers, **more)


def test_views_of_a_simulators_state_are_copied():
    state = np.zeros(1)

    def reused(rng, k):
        state[:] = k
        return walk(rng, k)[0], state[:1]  # as `data.qpos[2:3]` of one MuJoCo state for all runs

    runs = pj.learning.collect(system(reused, 0), KEY, n=20, quiet=True)
    assert (runs.q == runs.k).all()


def test_what_is_masked_is_unknown_and_complex_numbers_are_refused():
    def masked(rng, k):
        p, q = walk(rng, k)
        return np.ma.masked_greater(p - p[0], 1.0), q

    def imaginary(rng, k):
        return walk(rng, k)[0] + 1j, [k[0]]

    free = pj.learning.collect(system(walk, 0), KEY, n=40, quiet=True)
    runs = pj.learning.collect(system(masked, 0), KEY, n=40, quiet=True)
    assert (runs.failed == (free.p > 1.0).any(axis=(1, 2))).all() and 0 < runs.failed.sum() < 40
    with pytest.raises(InputError, match="expected real numbers; got complex"):
        pj.learning.collect(system(imaginary, 0), KEY, n=4, quiet=True)


def test_what_never_works_is_an_error():
    with pytest.raises(
        InputError,
        match=r"all 5 runs of a batch failed.*expected p \(3, 2\) on the record grid",
    ):
        pj.learning.collect(system(broken, 0), KEY, n=5, quiet=True)


def test_what_cannot_be_sent_is_refused_at_once():
    with pytest.raises(InputError, match="workers=0"):
        system(lambda rng, k: walk(rng, k), 2)
    with pytest.raises(InputError, match="expected a function"):
        system(3, 0)
    with pytest.raises(InputError, match="n_p >= 1"):
        python_system(walk, DOMAIN, TIME, name="walk", n_p=0, workers=0)
    assert system(lambda rng, k: walk(rng, k), 0).chunk > 0


def test_translation_invariance_is_measured():
    starts = np.array([[1.0, -2.0], [30.0, 0.0]])
    same = translation_gap(system(walk, 0, simulate_from=walk_from), KEY, starts)
    assert same.p.max() < 1e-12
    pulled = functools.partial(walk_from, pull=0.1)
    assert translation_gap(
        system(walk, 0, simulate_from=pulled), KEY, starts
    ).p.tolist() == pytest.approx([3.0, 0.2])
    with pytest.raises(InputError, match="rollout_from"):
        translation_gap(system(walk, 0), KEY, starts)


def test_a_run_that_ends_its_program_has_failed_and_is_made_once():
    """Also where what is lost is made again: it was not lost, and sys.exit is no machine's."""

    def leaves(rng, k):
        if rng.random() < 0.5:
            sys.exit(1)
        return walk(rng, k)

    runs = pj.learning.collect(system(leaves, 0), KEY, n=64, quiet=True)
    assert 0.3 < runs.failed.mean() < 0.7 and runs.lost is None


class Cart:
    """Put back at the start of each run, but for its speed."""

    v = 0.0

    def keeps(self, rng, k):
        self.v = 0.5 * self.v + k[0]
        return np.array([[0.0, 0.0], [self.v, 0.0], [2 * self.v, 0.0]]), [k[0]]


def test_runs_that_depend_on_earlier_ones_are_refused():
    """They repeat no run, so the first is made again after the last, without any file."""
    rng = np.random.default_rng(0)
    for simulate in (Cart().keeps, lambda _, k: walk(rng, k)):
        for n in (1, 40):
            with pytest.raises(InputError, match="walk: expected runs to repeat"):
                pj.learning.collect(system(simulate, 0), KEY, n=n, k=[0.5], quiet=True)
    stream = stream_rollouts(system(Cart().keeps, 0), KEY, 40, chunk=8, quiet=True)
    assert next(stream).n == 8  # nothing is said of one that is left early


def test_a_run_that_failed_or_fails_when_made_again_tells_nothing():
    made = []

    def fragile(rng, k):
        made.append(k)
        assert len(made) not in failing
        return walk(rng, k)

    for failing in ({1}, {9}):
        made.clear()
        runs = pj.learning.collect(system(fragile, 0), KEY, n=8, quiet=True)
        assert len(made) == 9 and runs.failed.sum() == len(failing & {1})
