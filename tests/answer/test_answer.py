"""The content of an answer and its refusals, against an answer whose true values are known."""

import copy
import pickle
from dataclasses import replace
from fractions import Fraction

import jax
import pytest
from toy_whole import answer

import parc_jax as pj
from parc_jax.problem.robust.realisations import Robustness


def test_membership_needs_goal_and_start_too():
    """Without obstacles every plan satisfies every corridor: only goal and start can refuse it."""
    k = answer().samples[:1, 2:]
    hit, missed = answer().samples[:1, :2], answer().samples[:1, :2] + 5.0
    for members in (answer(), answer().polytopes(jax.random.key(1), 50)):
        assert members.contains(hit, k).all() and not members.contains(missed, k).any()


def test_plans_of_an_answer_are_not_written_over():
    """Moved in place they were called proved, on its page, by the certificates of others."""
    own = replace(answer(), samples=(plans := answer().samples.copy()))
    copied = pickle.loads(pickle.dumps(own))
    for samples in (own.samples, own.samples[:, :2], answer().samples, copied.samples):
        with pytest.raises(ValueError, match="read-only"):
            samples += 0.35
    plans += 0.35
    assert (own.samples == answer().samples).all()


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
def test_copies_are_not_written_over_and_are_checked_anew(copied):
    """Another tube, written over that of a copy whose claim was checked before, was believed."""
    answer().model.claim.details()
    problem, model = copied((answer().problem, answer().model))
    for array in (problem.goal.A, problem.goal.b, *model.net.weights, model.tube.interval):
        with pytest.raises(ValueError, match="read-only"):
            array *= 0.5
    model.tube.interval.setflags(write=True)
    model.tube.interval[:] += 0.5
    with pytest.raises(pj.InputError, match="expected the network, tube, K"):
        model.claim.details()


def test_the_share_of_k_is_a_lower_bound():
    """All of K is hit, by 20,000 draws: the share is at least the thousandth's 20,000th root."""
    assert answer().share_of_k() == pytest.approx(0.001 ** (1 / 20_000), abs=1e-8)


def test_of_a_slice_of_k_no_share_of_k_is_known():
    """It was that of the chosen parameters, of which a claim over all of K says nothing."""
    of_all = answer().scene.nominal
    for parameters, share in (((2, 2), 1.0), ((2, 1), 0.0), ((3, 2), 0.0)):
        given = Robustness("k1 = 0.3", Fraction(0), parameters, of_all.model.domain.volume, True)
        scene = replace(answer().scene, nominal=replace(of_all, uncertainty=given))
        found = replace(answer(), scene=scene).share_of_k()
        assert found == share * answer().share_of_k()


def test_an_answer_has_few_members():
    """What a user meets; the rest is the record of the search and the nominal problem."""
    fields = set(pj.types.Answer.__dataclass_fields__)
    members = {name for name in {*dir(pj.types.Answer), *fields} if name[0] != "_"}
    inside = {"scene", "cover", "looks", "written", "certificates", "unchecked"}
    assert inside < members and len(members - inside) <= 22
