"""From a holdout to a claim: what is refused, what is reported, what is never dropped."""

from dataclasses import replace
from fractions import Fraction

import jax
import numpy as np
import pytest
from profiles import training_profile
from scored import score_batch, score_system
from synthetic_plants import exact, failing, noisy, plant, straight_network

from parc_jax.app.study.settings import Study
from parc_jax.checker import Rejected
from parc_jax.checker.claim import checked_claim
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.drive.local.localise import Local
from parc_jax.learning.bound.bins import block_shares
from parc_jax.learning.bound.calibrate import (
    calibrate,
    calibrate_bins,
)
from parc_jax.learning.bound.counts import NoStatement, most_discards, supported_eps
from parc_jax.learning.bound.declared import assumed_claim
from parc_jax.learning.bound.measure import measure
from parc_jax.learning.bound.monitor import inside_tube, monitor
from parc_jax.learning.bound.pipeline import bound_error
from parc_jax.learning.bound.settings import (
    AccelerationBound,
    ModelBound,
    SpeedBound,
)
from parc_jax.learning.network.relu import relu_network
from parc_jax.learning.runs import collect as rolling
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.joined import concatenate

KEY, NET = jax.random.PRNGKey(0), straight_network(4)
pytestmark = pytest.mark.soundness


@pytest.fixture(scope="module")
def system():
    return plant(noisy)


@pytest.fixture(scope="module")
def train(system):
    return collect(system, KEY, 500, quiet=True)


@pytest.fixture(scope="module")
def profile(train):
    return training_profile(NET, train, (3, 1))


@pytest.fixture(scope="module")
def holdout(system):
    return collect(system, KEY, 688, Stage.BOUND, quiet=True)


def test_the_tube_holds_every_run_it_was_sized_by(holdout, profile, train):
    claim = calibrate(NET, holdout, profile, eps=1e-2, delta=1e-3, train=train)
    assert (claim.eps, claim.delta, claim.n, claim.kind) == (
        Fraction(1, 100),
        Fraction(1, 1000),
        688,
        "pac",
    )
    errors, number = measure(NET, holdout), claim.tube.bin_of(holdout.k)
    assert (errors.interval <= claim.tube.interval[number]).all() and (
        errors.final <= claim.tube.final[number]
    ).all()
    assert inside_tube(claim, NET, holdout).all()
    touching = (errors.interval >= claim.tube.interval[number] * (1 - 1e-12)).any() or (
        errors.final >= claim.tube.final[number] * (1 - 1e-12)
    ).any()
    assert touching  # and no larger than the worst run needs


def test_more_runs_than_asked_for_leave_some_outside_or_support_a_smaller_eps(holdout, profile):
    many = holdout.select(slice(99))
    claim = calibrate(NET, many, profile, eps=0.1, delta=0.05, discard=0)
    assert claim.eps == supported_eps(99, 0.05) < Fraction(31, 1000)
    assert "at most 0.0298" in claim.details() and "asked" not in claim.details()
    assert calibrate(NET, many, profile, eps=0.1, delta=0.05, discard=2).eps == supported_eps(
        99, 0.05, 2
    )
    # by default the runs beyond the need are spent on a smaller tube instead, and it says so
    spent = calibrate(NET, many, profile, eps=0.1, delta=0.05)
    assert spent.eps == Fraction(1, 10) and spent.discard == most_discards(99, 0.1, 0.05) > 2
    assert f"discards, fixed beforehand: {spent.discard}" in spent.details()
    assert calibrate(NET, holdout.select(slice(29)), profile, eps=0.1, delta=0.05).eps == Fraction(
        1, 10
    )


def test_few_runs_support_a_larger_eps_and_say_so(holdout, profile):
    claim = calibrate(NET, holdout.select(slice(60)), profile, eps=1e-3, delta=1e-3)
    assert 0.1087 < claim.eps < 0.1088
    assert "eps = 0.001 (needs 6,905 runs) was asked; 60 runs do not support it" in claim.details()
    with pytest.raises(InputError, match="support no eps"):
        calibrate(NET, holdout.select(slice(3)), profile, eps=1e-3, delta=1e-3, discard=3)


def numbered(batch, row):
    """One run under a number that no other has."""
    return replace(batch.select([row]), rows=np.array([1000 + row]))


def test_copies_and_training_runs_are_refused(system, holdout, profile, train):
    with pytest.raises(InputError, match="occur twice"):
        calibrate(NET, concatenate([holdout, numbered(holdout, 4)]), profile, eps=1e-2)
    with pytest.raises(InputError, match="500 of 500 runs are training runs"):
        calibrate(NET, train, profile, eps=1e-2, train=train)
    renamed = replace(holdout, seed=None, stage=None)  # the same content under another name
    one_seen = concatenate([renamed, replace(numbered(train, 7), seed=None, stage=None)])
    with pytest.raises(InputError, match="1 of 689"):
        calibrate(NET, one_seen, profile, eps=1e-2, train=train)
    with pytest.raises(InputError, match="training runs"):
        scores = score_system(NET, system, KEY, profile, 700, Stage.TRAIN, quiet=True)
        calibrate(NET, scores, profile, eps=1e-2, train=train)


def test_scores_are_of_this_network_and_profile(holdout, profile, train):
    """Those of another profile gave a tube a tenth as wide."""
    scores = score_batch(NET, holdout, profile)
    other = relu_network([0.5 * w for w in NET.weights], NET.biases)
    small = profile.with_halves(*(half / 10 for half in profile.halves))
    for make in (calibrate, calibrate_bins):
        ours = [make(NET, x, profile, eps=0.1, delta=0.01) for x in (scores, holdout)]
        assert ours[0].hash == ours[1].hash
        for net, shape in ((NET, small), (other, profile)):
            with pytest.raises(InputError, match="scores of this network and profile; got"):
                make(net, scores, shape, eps=0.1, delta=0.01)


@pytest.mark.parametrize("blocks", [(1.5, 1), ("2", 1), (True, 1), (0, 1), (1,), (2, None), 2])
def test_blocks_are_whole_numbers(holdout, profile, blocks):
    with pytest.raises(InputError, match=r"^blocks: expected (a whole|2) numbers? >= 1"):
        calibrate_bins(NET, score_batch(NET, holdout, profile), profile, blocks=blocks)


def test_a_failed_run_is_an_infinite_score(profile):
    broken = collect(plant(failing), KEY, 688, Stage.BOUND, quiet=True)
    scores = score_batch(NET, broken, profile)
    assert (np.isinf(scores.score) == broken.failed).all() and broken.failed.any()
    claim = calibrate(NET, broken, profile, eps=1e-2, discard=0)
    assert not claim.tube.claimed.any() and claim.details().startswith("No claim")
    assert isinstance(claim.risk(share=0.5), NoStatement)
    kept = calibrate(NET, broken, profile, eps=0.1, delta=1e-3, discard=int(broken.failed.sum()))
    assert kept.tube.claimed.all() and kept.eps < Fraction(1, 10)


def test_discards_and_looks_cost_runs(holdout, profile):
    plain = calibrate(NET, holdout, profile, eps=0.02, delta=1e-3, discard=0)
    most = calibrate(NET, holdout, profile, eps=0.02, delta=1e-3, discard="most")
    assert (
        most.discard >= 1
        and most.eps == Fraction(1, 50) > plain.eps
        and most.tube.interval.sum() < plain.tube.interval.sum()
    )
    assert calibrate(NET, holdout, profile, eps=1e-2, delta=1e-3, looks=2).eps > Fraction(1, 100)
    scores = np.sort(score_batch(NET, holdout, profile).score)
    assert float.fromhex(most.evidence["scale"]) == scores[-1 - most.discard]


@pytest.mark.parametrize("discard", [2.5, -1, True, "all", None])
def test_a_number_of_discards_is_a_number(holdout, profile, discard):
    """Refused in one sentence by whatever takes one, before a run is made or looked at."""
    scores = score_batch(NET, holdout, profile)
    for refused in (
        lambda: calibrate(NET, holdout, profile, eps=1e-2, discard=discard),
        lambda: calibrate_bins(NET, scores, profile, discard=discard),
        lambda: bound_error(NET, None, KEY, discard=discard),
        lambda: Local(discard=discard),
        lambda: Study(bound=ModelBound(discard=discard)),
    ):
        with pytest.raises(InputError, match=r"^discard: expected a whole number >= 0; got .*\.$"):
            refused()
    with pytest.raises(InputError, match=r"^looks: expected a whole number >= 1"):
        calibrate(NET, holdout, profile, eps=1e-2, looks=discard)


@pytest.mark.parametrize(
    "options",
    [
        {"gap": 0.3},
        {"bins": (3, 3)},
        {"bins": [np.linspace(0, 1, 3)] * 2},
        {"claims": ("bins",)},
        {"shape": "fitted"},
        {"fresh": 60},
        {"profile_runs": 10},
        {"blocks": (2, 1)},
    ],
    ids=lambda options: next(iter(options)),
)
def test_what_a_calibration_would_not_use_is_refused(holdout, profile, options):
    for make in (calibrate, *[calibrate_bins] * ("blocks" not in options)):
        with pytest.raises(InputError, match="expected no such option with runs and a profile"):
            make(NET, holdout, profile, **options)


def test_time_between_records_is_declared_and_added(holdout, profile):
    plain = calibrate(NET, holdout, profile, eps=1e-2)
    fast = calibrate(NET, holdout, profile, eps=1e-2, intersample=SpeedBound((2.0, 4.0)))
    np.testing.assert_allclose(
        fast.tube.interval - plain.tube.interval, [[[0.05, 0.1]] * 4] * 3, rtol=1e-9
    )
    np.testing.assert_array_equal(fast.tube.final, plain.tube.final)
    bent = calibrate(NET, holdout, profile, eps=1e-2, intersample=AccelerationBound(8.0))
    np.testing.assert_allclose(bent.tube.interval - plain.tube.interval, 8 * 0.05**2 / 8, rtol=1e-9)
    assert (
        "speed <= (2.0, 4.0) m/s" in fast.details()
        and "DISCRETE_TIME(h = 0.05 s)" in plain.details()
    )
    assert (inside_tube(fast, NET, holdout) == inside_tube(plain, NET, holdout)).all()
    with pytest.raises(InputError, match="speed bound"):
        calibrate(NET, holdout, profile, eps=1e-2, intersample=SpeedBound((1.0, 2.0, 3.0)))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_bound_between_records_that_the_records_refute_is_refused(train, dtype):
    """In the pipeline and alone, a bound that is just kept is believed; failed runs have none."""
    one = {"train": train, "eps": 0.05, "delta": 0.05, "bins": (1, 1), "quiet": True}
    runs = collect(plant(exact), KEY, 600, Stage.BOUND, quiet=True)
    p = runs.p.astype(dtype)
    p[7] *= 2.0 / np.abs(runs.k[7]).max()  # 2 m/s along one axis
    p[9, 3:] = np.nan
    runs = runs.replace(p=p)
    own = bound_error(NET, runs, None, intersample=SpeedBound(2.0), **one)
    assert "INTERSAMPLE(speed <= 2.0 m/s" in own.details()
    bent = p.copy()
    bent[5, 10] += 0.03  # there and back within 0.05 s
    for between, some, words in (
        (SpeedBound((1.9, 1.9)), p, r"speed <= \(1.9, 1.9\) m/s, h = 0.05 s\), as declared; the"),
        (AccelerationBound(20.0), bent, "acceleration <= 20.0 m/s.2, h = 0.05 s.*row 5 need 24"),
    ):
        told = runs.replace(p=some)
        with pytest.raises(InputError, match=rf"^plant: expected runs that keep to .*{words}"):
            bound_error(NET, told, None, intersample=between, **one)
        with pytest.raises(InputError, match=words):
            profile = training_profile(NET, train, (1, 1))
            calibrate(NET, told, profile, eps=0.05, intersample=between)
        with pytest.raises(InputError, match=words):
            calibrate(NET, score_batch(NET, told, profile), profile, intersample=between)
        believed = runs.select(slice(10, 600))
        claim = bound_error(NET, believed, None, intersample=between, **one)
        with pytest.raises(InputError, match=words):
            monitor(claim, NET).observe(told.select(slice(0, 10)))


def arithmetic(claim):
    """What the checker finds of a claim as it stands in a file."""
    hashes = {"network": "", "tube": ""}
    named = {f"{part}_hash": "" for part in hashes}
    return checked_claim(claim.to_json() | named, hashes, claim.tube.n_bins)


def test_the_checker_does_the_sums_of_claims_again(system, holdout, profile):
    """Of one over K, of each block, of those told of copies; and finds those that are wrong."""
    one = calibrate(NET, holdout, profile, eps=1e-2, delta=1e-3, discard="most", looks=2)
    assert arithmetic(one)["says"].startswith(f"{one.n} independent runs, {one.discard} left")
    scores = score_system(NET, system, KEY, profile, 3000, quiet=True)
    bins = calibrate_bins(NET, scores, profile, eps=1e-2, delta=1e-3)
    assert [b["n"] for b in bins.evidence["blocks"]] == bins.evidence["bin_runs"]
    assert arithmetic(bins)["says"].startswith("in 3 blocks with 3 of 3 bins ")
    for wrong in (
        replace(one, n=one.n // 2),
        replace(one, looks=99),
        replace(bins, delta=Fraction(1, 10**6)),
        replace(bins, bin_eps=(Fraction(1, 10**9), *bins.bin_eps[1:])),
    ):
        with pytest.raises((Rejected, InputError)):
            arithmetic(wrong)


def test_a_logged_k_on_an_edge_between_bins_is_refused(system, holdout, profile):
    """Each bin's claim is true, and all together leave more often: its run counts in both."""
    k = holdout.k.copy()
    k[:9, 0] = profile.edges[0][1]
    scores = score_batch(
        NET, replace(holdout, k=k, law=replace(holdout.law, k_law="logged")), profile
    )
    with pytest.raises(InputError, match="no k on an edge between bins"):
        calibrate_bins(NET, scores, profile, eps=0.1, delta=0.05)


def test_per_bin_claims_need_runs_in_every_bin(system, profile, train):
    scores = score_system(NET, system, KEY, profile, 3000, quiet=True)
    claim = calibrate_bins(NET, scores, profile, eps=1e-2, delta=1e-3, train=train, discard=0)
    assert "in each claimed bin" in claim.details()
    supported = [supported_eps(n, 1e-3 / 3) for n in claim.evidence["bin_runs"]]
    assert list(claim.bin_eps) == supported and claim.eps == max(supported) < Fraction(1, 100)
    assert (
        claim.risk(share=0.1, bin=1).bound
        == supported[1] * block_shares(profile.edges, np.arange(profile.n_bins))[1] * 10
    )
    spent = calibrate_bins(NET, scores, profile, eps=1e-2, delta=1e-3, discard="most")
    assert spent.bin_eps == (Fraction(1, 100),) * 3
    assert isinstance(claim.risk(), NoStatement)
    one = np.array([float.fromhex(s) for s in claim.evidence["bin_scale"]])
    assert one.max() == scores.score.max() and one.min() < one.max()
    lopsided = score_system(NET, system, KEY, profile, 900, k=_mostly_left, quiet=True)
    thin = calibrate_bins(NET, lopsided, profile, eps=1e-2, delta=1e-3)
    assert thin.tube.claimed.tolist() == [True, False, False] and thin.bin_eps[1:] == (None, None)
    assert isinstance(
        thin.risk(share=0.1, bin=0), NoStatement
    )  # this law is not uniform: shares unknown
    with pytest.raises(InputError, match="at least 8,003 runs in a bin"):
        calibrate_bins(NET, scores, profile, eps=1e-3, delta=1e-3)


def test_a_block_of_bins_has_one_claim_and_one_number(system, train):
    profile = training_profile(NET, train, (5, 2))
    scores = score_system(NET, system, KEY, profile, 3000, quiet=True)
    options = {"discard": "most"}
    claim = calibrate_bins(NET, scores, profile, eps=1e-2, delta=1e-3, blocks=(2, 1), **options)
    assert "in each claimed block of bins" in claim.details()
    left = profile.bin_of(scores.k) < 6  # three of the five columns, two bins each
    scale = [float.fromhex(s) for s in claim.evidence["bin_scale"]]
    for inside, own in ((left, scale[:6]), (~left, scale[6:])):
        kept = most_discards(int(inside.sum()), 1e-2, 1e-3 / 2)
        assert set(own) == {np.sort(scores.score[inside])[-1 - kept]}
    assert np.ptp(claim.tube.interval[:6, 2, 0]) > 0  # the widths still differ from bin to bin
    assert claim.bin_eps == (Fraction(1, 100),) * 10
    assert claim.risk(share=0.05, bin=1).bound == Fraction(1, 100) * sum(
        block_shares(profile.edges, np.arange(profile.n_bins))[:6]
    ) / Fraction("0.05")
    each, none = (
        calibrate_bins(NET, scores, profile, eps=0.05, delta=1e-3, blocks=blocks, **options)
        for blocks in ((9, 2), None)
    )
    assert each.tube.hash == none.tube.hash and each.details() == none.details()


@jax.jit
def _mostly_left(key):
    u = jax.random.uniform(key, (2,))
    return u.at[0].multiply(jax.numpy.where(u[1] < 0.95, 0.33, 1.0))


def test_the_one_call(system, train):
    claim = bound_error(
        NET, system, KEY, eps=0.05, delta=0.01, bins=(2, 1), train=train, quiet=True
    )
    assert claim.n == 90 and claim.tube.n_bins == 2
    chosen = bound_error(NET, system, KEY, eps=0.05, delta=0.01, train=train, quiet=True)
    assert chosen.tube.n_bins >= 2  # the error grows along an axis of K


def test_a_killed_one_call_continues_with_the_same_claim(system, train, tmp_path, monkeypatch):
    arguments = {
        "eps": 0.05,
        "delta": 0.01,
        "bins": (2, 1),
        "train": train,
        "quiet": True,
    }
    whole = bound_error(NET, system, KEY, **arguments)
    monkeypatch.setattr(
        "parc_jax.learning.bound.pipeline.calibrate",
        lambda *a, **b: (_ for _ in ()).throw(KeyboardInterrupt),
    )
    with pytest.raises(KeyboardInterrupt):
        bound_error(NET, system, KEY, path=tmp_path, **arguments)
    monkeypatch.undo()
    real, calls = rolling.simulate_rows, []
    monkeypatch.setattr(rolling, "simulate_rows", lambda *a: (calls.append(a), real(*a))[1])
    assert bound_error(NET, system, KEY, path=tmp_path, **arguments).to_json() == whole.to_json()
    # one stored chunk of the profile's runs and one of the holdout's are run again, to see that the
    # system still repeats them
    assert len(calls) == 2


def test_the_published_bound_is_the_training_maximum(train):
    claim, errors = assumed_claim(NET, train), measure(NET, train)
    np.testing.assert_array_equal(claim.tube.interval[0], errors.interval.max(axis=0))
    assert claim.kind == "assumed" and claim.eps is None
    p = np.array(train.p)
    p[:7, -1] = np.nan
    log = replace(train, p=p, seed=None)
    for runs, n, failed in (
        (train, train.n, 0),
        (log, train.n - 7, 7),
        (log.finite, train.n - 7, 0),
        (replace(train, p=p).finite, train.n - 7, 0),
    ):
        said = f"over the {n:,} training rollouts that did not fail ({failed} failed), of "
        assert f"{said}{runs.law.describe()}, the" in assumed_claim(NET, runs).details()
    for runs in (log, replace(train, p=p)):
        assert "failed runs = all left out" in assumed_claim(NET, runs.finite).details()
        said = "LEFT_OUT(7 of their log),"  # of no claim, so not said to be by chance
        for some in (runs.finite, runs.select(~runs.failed)):  # by whomever
            assert said in assumed_claim(NET, some).details()
        assert "LEFT_OUT" not in assumed_claim(NET, runs).details()
    by_bin = assumed_claim(NET, train.select(train.k[:, 0] < 0.4), (2, 1))
    assert by_bin.tube.claimed.tolist() == [True, False]
