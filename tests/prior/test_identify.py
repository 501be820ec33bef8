"""A twist from runs of a robot whose twist is known, integrated by other means."""

import dataclasses

import numpy as np
import pytest
import slipping

from parc_jax.common.errors import InputError
from parc_jax.common.sets.box import box
from parc_jax.learning.prior.identify import Kind, chosen_kind, fitted, folds, moving_body
from parc_jax.learning.runs.batch import rollout_batch
from parc_jax.learning.runs.law import law_spec

TRAIN, FRESH = slipping.drawn(60), slipping.drawn(200, seed=7)


def identify(runs):
    """The twist of the kind that the runs choose."""
    seen = moving_body(runs)
    return fitted(seen, chosen_kind(seen))


def worst(model, runs) -> float:
    """[m] of any point at any record."""
    p = np.asarray(model.rollout_batch(None, runs.k).p).reshape(runs.p.shape)
    return float(np.abs(p - runs.p).max())


@pytest.mark.parametrize("one_point", [False, True])
def test_the_twist_of_noiseless_runs_is_found_and_is_the_same_at_other_k(one_point):
    model = identify(slipping.recorded(TRAIN, one_point=one_point))
    assert model.gain.shape == (1, 3, 3)  # linear in k, constant in time
    assert worst(model, slipping.recorded(FRESH, one_point=one_point)) < 1e-4
    corners = slipping.K.lo[None], slipping.K.hi[None]
    seen = [slipping.slipped(k) for k in corners]
    terms = [np.array([[1.0, -1.0, -1.0]]), np.array([[1.0, 1.0, 1.0]])]
    for term, twist in zip(terms, seen, strict=True):
        np.testing.assert_allclose(term @ model.gain[0], twist, atol=1e-4)


@pytest.mark.slow
def test_a_robot_that_lags_takes_polynomials_in_time():
    runs = slipping.recorded(slipping.drawn(150), lag=0.4, noise=0.003)
    model = identify(runs)
    assert len(model.gain) > 1
    constant = fitted(moving_body(runs), Kind(1, 0))
    fresh = slipping.recorded(FRESH, lag=0.4)
    assert worst(model, fresh) < 0.03 < 0.08 < worst(constant, fresh)


def test_goal_states_are_learned_too():
    fresh = slipping.recorded(FRESH)
    got = identify(slipping.recorded(TRAIN)).rollout_batch(None, fresh.k).q
    np.testing.assert_allclose(got, fresh.q, atol=1e-6)


def test_some_runs_unlike_all_others_do_not_bend_the_twist():
    odd = slipping.slipped(TRAIN)
    odd[:6] = -odd[:6]  # wheels that stick, a localisation that jumped
    model = identify(slipping.recorded(TRAIN, odd, noise=0.01))
    assert worst(model, slipping.recorded(FRESH)) < 0.05


def test_failed_runs_are_left_out():
    runs = slipping.recorded(TRAIN)
    p = runs.p.copy()
    p[3, 5:] = np.nan
    assert worst(identify(runs.replace(p=p)), slipping.recorded(FRESH)) < 1e-4


def test_groups_stay_whole_in_every_fold():
    groups = np.repeat(np.arange(20), 3)
    runs = slipping.recorded(TRAIN, groups=groups)
    held = np.zeros(runs.n, int)
    for fit, other in folds(runs):
        assert not set(groups[fit]) & set(groups[other]) and (fit != other).all()
        held += other
    assert (held == 1).all()


def test_what_is_no_rigid_body_in_its_own_frame_is_refused():
    runs = slipping.recorded(TRAIN)
    p = runs.p.copy()
    p[..., 2] += 0.3 * np.linspace(0, 1, runs.p.shape[1])
    bent = dataclasses.replace(runs, p=p)
    with pytest.raises(InputError, match=r"one rigid body; they move against each other by 0\.27"):
        identify(bent)
    z = runs.p.reshape(*runs.p.shape[:2], -1, 2) @ np.array([1.0, 1j])
    angle = np.random.default_rng(0).uniform(-3, 3, (runs.n, 1, 1))
    z = z * np.exp(1j * angle)
    p = np.stack([z.real, z.imag], axis=-1).reshape(runs.p.shape)
    with pytest.raises(InputError, match="the frame in which it begins"):
        identify(runs.replace(p=p))
    with pytest.raises(InputError, match="at least 8 finite training runs; got 5 of 5"):
        identify(runs.select(slice(0, 5)))
    lo, hi = slipping.K.lo, slipping.K.hi
    space = np.zeros((60, slipping.TIME.n_record + 1, 3))
    law = law_spec("file:drone", box(lo, hi), "logged")
    flying = rollout_batch(
        TRAIN, space, np.zeros((60, 0)), time=slipping.TIME, domain=box(lo, hi), law=law
    )
    with pytest.raises(InputError, match="positions in the plane; got 3 axes"):
        identify(flying)
