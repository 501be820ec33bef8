"""Few recorded runs, from a prior to a claim: whatever the prior was, the robot's runs decide."""

import json

import numpy as np
import pytest
import slipping

import parc_jax as pj
from parc_jax.app import cli
from parc_jax.common.errors import InputError
from parc_jax.common.keys import key_of
from parc_jax.learning.bound.monitor import inside_tube
from parc_jax.learning.learn import WITH_PRIOR, learn_report
from parc_jax.learning.runs.groups import worst_by_group
from parc_jax.learning.system import Trajectory

AFFINE = {"hidden": (), "rollouts": 400}  # PARC's map: nothing is trained
RUNS = slipping.recorded(slipping.drawn(120), noise=0.01)


def learnt(runs, prior="twist", **options):
    """As `pj.learn` with a prior, with the training runs and the sentence about the prior."""
    return learn_report(runs, key_of(0), WITH_PRIOR.replace(**AFFINE | options), prior)


class Backwards:
    """A simulator that drives the other way."""

    name, n_p, n_q, points = "backwards", 2, 1, slipping.NAMES
    domain, time = slipping.K, slipping.TIME

    def rollout_batch(self, keys, ks):
        done = slipping.recorded(np.asarray(ks), -slipping.slipped(np.asarray(ks)))
        return Trajectory(done.p.reshape(len(ks), -1, len(self.points), 2), done.q)


@pytest.fixture(scope="module")
def learned():
    return learnt(RUNS)


def left(learned, runs) -> int:
    """Groups that leave the tube."""
    model = learned.model
    return int(worst_by_group(~inside_tube(model.claim, model.net, runs), runs.groups).sum())


def test_the_claim_is_of_the_held_out_runs_alone(learned):
    train, held = RUNS.split(0.5)
    claim = learned.model.claim
    np.testing.assert_array_equal(learned.train.k, train.k)
    assert (claim.kind, claim.n, claim.discard) == ("pac", held.n, left(learned, held))
    assert claim.law.generator == "file:slipping" and learned.model.system == "file:slipping"
    assert "60 calibration rollouts" in claim.details()
    assert learned.prior.startswith("prior twist, order 1 in k and 0 in time; residuals left out")


def test_a_prior_that_is_wrong_costs_width_and_never_the_claim(learned):
    no_help = learnt(RUNS, Backwards())
    _, held = RUNS.split(0.5)
    claim = no_help.model.claim
    assert left(no_help, held) == claim.discard and claim.eps >= learned.model.claim.eps
    assert no_help.prior.startswith("prior backwards; corrected by residuals")


@pytest.mark.slow
def test_discards_are_of_the_training_runs_and_not_of_what_is_held_out(learned):
    _, held = RUNS.split(0.5)
    p = RUNS.p.copy()
    p[held.rows[:3], 1:] += 5.0
    spoiled = RUNS.replace(p=p)
    other = learnt(spoiled).model
    assert other.claim.discard == learned.model.claim.discard
    assert other.claim.eps == learned.model.claim.eps
    assert other.tube.final.max() > 4.0 and left(learnt(spoiled), held) == 0


@pytest.mark.night
def test_training_runs_that_stick_out_advise_discards_and_do_not_widen_the_profile():
    train, held = RUNS.split(0.5)
    p = RUNS.p.copy()
    p[np.concatenate([train.rows[:3], held.rows[:3]]), 1:] += 3.0
    odd = RUNS.replace(p=p)
    found = learnt(odd)
    assert 3 <= found.model.claim.discard <= 6 and found.model.tube.final[:, :2].max() < 0.5
    assert f"; {found.model.claim.discard} held-out runs left outside" in found.prior
    all_in = learnt(odd, discard=0)
    assert all_in.model.tube.final[:, :2].max() > 2.0 and all_in.model.claim.discard == 0
    assert "left outside" not in all_in.prior


def test_groups_stay_whole_and_count_once():
    groups = np.repeat(np.arange(40), 3)
    claim = learnt(RUNS.replace(groups=groups)).model.claim
    assert claim.n == 20 and "20 calibration recordings (of 60 runs)" in claim.details()


def test_bad_input_is_refused():
    with pytest.raises(InputError, match=r"between 0 and 1; got 1\.5"):
        pj.learn(RUNS, key_of(0), "twist", holdout=1.5)
    with pytest.raises(InputError, match="eps: expected a probability"):
        pj.learn(RUNS, key_of(0), "twist", eps=2)
    with pytest.raises(InputError, match="key: expected a random key"):
        pj.learn(RUNS, 0, "twist")
    with pytest.raises(InputError, match="expected prior and holdout with recorded runs only"):
        pj.learn(Backwards(), key_of(0), "twist")


def test_the_shell_is_the_same_door(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("parc_jax.app.cli.logged.WITH_PRIOR", WITH_PRIOR.replace(**AFFINE))
    points = RUNS.p.reshape(RUNS.n, -1, len(RUNS.points), 2)
    np.savez("log.npz", k=RUNS.k, p=points, q=RUNS.q, points=RUNS.points)
    times = ("--dt", "0.25", "--t-f", "2", "--dt-record", "0.125")
    shell = ("learn", "log.npz", *times, "--prior", "twist", "--out", "m.npz", "--json")
    with pytest.raises(SystemExit) as stop:
        cli.main([*shell, "--no-cache", "--quiet"])
    told = json.loads(capsys.readouterr().out)
    assert stop.value.code == 0 and told["prior"].startswith("prior twist, order 1 in k")
    time = slipping.TIME
    same = learnt(pj.load_rollouts("log.npz", time)).model
    assert pj.load("m.npz").net.hash == same.net.hash
    assert pj.load("m.npz").tube.hash == same.tube.hash
    # nobody declared K: it is the box of the training half, and the claim is about k in it
    assert told["claim"]["n"] == 55 and "which 5 of 60 others miss" in told["claim"]["quantifier"]
