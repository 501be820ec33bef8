"""Watching a claim: silent while it is true, rings when it is not; and a new claim from new
data.
"""

import copy
import json
import pickle
import re
from dataclasses import replace
from fractions import Fraction
from functools import partial
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from synthetic_plants import (
    between_knots,
    disturbed,
    exact,
    plant,
    straight_network,
)

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.common.sets.box import box
from parc_jax.learning.bound.claim import derived
from parc_jax.learning.bound.counts import most_discards
from parc_jax.learning.bound.declared import assumed_claim
from parc_jax.learning.bound.fresh import entry_of, noted
from parc_jax.learning.bound.measure import allowance, kept
from parc_jax.learning.bound.monitor import inside_tube, monitor
from parc_jax.learning.bound.pipeline import bound_error, update
from parc_jax.learning.bound.statement import in_short
from parc_jax.learning.bound.tube import tube
from parc_jax.learning.runs.batch import rollout_batch
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.independent import marks_by_k, repeated
from parc_jax.learning.runs.law import FITTED, TO_TRAINING, law_spec
from parc_jax.learning.system import time_grid
from parc_jax.learning.systems.chained import Chained

KEY, NET = jax.random.PRNGKey(0), straight_network(4)
pytestmark = pytest.mark.soundness


@pytest.fixture(scope="module")
def claim():
    own = jax.random.PRNGKey(1)  # of which its profile has 2,000 training rows
    return bound_error(NET, plant(disturbed), own, eps=0.02, delta=1e-3, bins=(1, 1), quiet=True)


def test_a_true_claim_rarely_rings(claim, rng):
    alpha, alarms, watch = 0.05, 0, monitor(claim, NET, alpha=0.05)
    outside = rng.random((300, 400)) < watch.rate  # the worst rate that the claim allows
    gain = np.where(
        outside[..., None],
        np.log(watch.bets / watch.rate),
        np.log1p(-watch.bets) - np.log1p(-watch.rate),
    )
    wealth = np.exp(np.cumsum(gain, axis=1)).mean(axis=2)
    alarms = (wealth.max(axis=1) >= 1 / alpha).mean()
    assert alarms <= alpha + 4 * np.sqrt(alpha * (1 - alpha) / 300)
    state = watch
    for x in outside[0]:
        state = state.bet(bool(x))
    assert state.e_value == pytest.approx(wealth[0, -1]) and state.left == outside[0].sum()


def test_bets_of_a_monitor_are_not_written_over(claim):
    """Written into a copy they were those of the first one, too."""
    own = monitor(claim, NET)
    for one in (own, copy.copy(own), pickle.loads(pickle.dumps(own))):
        for array in (one.bets, one.log_wealth):
            with pytest.raises(ValueError, match="read-only"):
                array[:] = 0.3


def test_a_shifted_disturbance_rings(claim):
    shifted = collect(plant(partial(disturbed, scale=2.0)), KEY, 1500, quiet=True)
    before = monitor(claim, NET)
    after = before.observe(shifted)
    assert after.alarm and after.left / after.seen > 0.05 and after.e_value >= 1000
    assert not before.alarm and before.seen == 0  # monitors are values
    calm = before.observe(collect(plant(disturbed), jax.random.PRNGKey(8), 1500, quiet=True))
    assert not calm.alarm


def test_a_log_that_says_what_was_measured_is_not_of_a_claim_that_measures_nothing(claim):
    """A log may be silent of it; what it says, or a simulator, is compared."""
    runs = collect(plant(exact), KEY, 40, quiet=True)
    law = law_spec("file:log", runs.domain, claim.law.k_law)
    about = {"time": runs.time, "domain": runs.domain, "law": law}
    watch = monitor(claim, NET, share=1.0)
    assert watch.observe(rollout_batch(runs.k, runs.p, runs.q, **about)).seen == 40
    with pytest.raises(InputError, match="agree; given is none, beside 0"):
        watch.observe(rollout_batch(runs.k, runs.p, runs.q, given=(0,), **about))


@jax.jit
def breaks_down(key, k, s):
    """Runs in the right half of K fail."""
    p, q = disturbed(key, k, s)
    return jax.numpy.where(k[0] > 0.5, np.nan, p), q


def test_a_bin_without_a_claim_is_not_watched():
    """A failed run has left the tube, also an infinite one; of runs there nothing is said."""
    options = {"eps": 0.02, "delta": 1e-3, "bins": (2, 1), "claims": ("bins",), "quiet": True}
    claim = bound_error(NET, plant(breaks_down), jax.random.PRNGKey(1), **options)
    assert claim.tube.claimed.tolist() == [True, False]
    assert "k drawn uniformly from 1 of 2 bins of K with a claim, confidence" in in_short(claim)
    runs = collect(plant(breaks_down), KEY, 200, quiet=True)
    with pytest.raises(InputError, match=r"in bins that have a claim; .* of 200 runs are outside"):
        monitor(claim, NET).observe(runs)
    slack = allowance(NET, runs.domain, claim.tube.layout)
    with_claim = runs.k[:, 0] < 0.5
    assert not kept(NET, slack, claim, runs.k, runs.p, runs.q)[~with_claim].any()
    watch = monitor(claim, NET).observe(runs.select(with_claim))
    assert watch.seen == with_claim.sum() and not watch.alarm


def test_an_alarm_does_not_stop(claim):
    """Runs inside the tube win the wealth of the bets back; the claim stays refuted."""
    watch = monitor(claim, NET, alpha=0.05)
    for outside in [True] * 4 + [False] * 400:
        watch = watch.bet(outside)
    assert watch.e_value < 1 < 20 < watch.peak and watch.alarm


def test_a_run_that_leaves_the_tube_between_knots_has_left(claim):
    bent = collect(plant(between_knots(height=1.0)), KEY, 5, quiet=True)
    straight = collect(plant(exact), KEY, 5, quiet=True)
    assert not inside_tube(claim, NET, bent).any() and inside_tube(claim, NET, straight).all()
    once = np.array(straight.p)
    once[:, 7, 1] += 1.0  # one record of one axis
    assert not inside_tube(claim, NET, straight.replace(p=once)).any()


def test_runs_and_networks_of_others_are_not_watched(claim):
    runs = collect(plant(exact), KEY, 5, quiet=True)
    slower = runs.replace(time=time_grid(2 * runs.time.dt, 2.0, 2 * runs.time.dt_record))
    for others in (slower, runs.replace(points=("nose",))):
        with pytest.raises(InputError, match=r"expected premises that agree; (time|points) is"):
            monitor(claim, NET).observe(others)
    about = runs.subject.with_labels({"k": ("speed [m/s]", "turn [rad]")})
    named = runs.replace(labels=about.labels)
    tractor = collect(plant(exact, name="tractor"), KEY, 5, quiet=True)
    for others, words in (
        (tractor, "system is plant, beside tractor"),
        (runs.replace(k=runs.k + 2.0), "5 of 5 runs are outside.* do not use `closed`"),
    ):
        with pytest.raises(InputError, match=words):
            monitor(claim, NET).observe(others)
    assert monitor(claim, NET).observe(named).seen == 5  # only one of them has named its k
    corner = replace(plant(exact), domain=box([0.0, 0.0], [0.1, 0.1]))
    here = collect(corner, KEY, 5, quiet=True)
    with pytest.raises(InputError, match="got k uniform on K, on another K"):
        monitor(claim, NET).observe(here)
    assert monitor(claim, NET, share=0.1).observe(here).seen == 5
    other = NET.replace(biases=(NET.biases[0] + 1,))
    with pytest.raises(InputError, match="network its claim was measured on"):
        monitor(claim, other).observe(runs)


def test_a_log_of_a_part_of_k_is_of_another_law(claim):
    """Where the commands outside of a smaller K were left out: a true claim was refuted."""
    runs, small = collect(plant(exact), KEY, 60, quiet=True), box([0.5, 0.0], [1.0, 1.0])
    logged = derived(claim, law=law_spec("file:log", runs.domain, "logged"))
    inside, left_out = small.contains(runs.k), {FITTED: "as declared, which 30 of 60 commands miss"}
    law = law_spec("file:log", small, "logged", left_out)
    part = stored(runs, "logged").select(inside).replace(domain=small, law=law)
    with pytest.raises(InputError, match=r"got k as logged, on another K\. Declare it: monitor"):
        monitor(logged, NET).observe(part)
    assert monitor(logged, NET, share=0.5).observe(part).seen == inside.sum()
    fitted = law_spec("file:log", small, "logged", {FITTED: TO_TRAINING})  # none was left out
    assert monitor(logged, NET).observe(part.replace(law=fitted)).seen == inside.sum()
    whole = law_spec("file:log", box([-1.0] * 2, [2.0] * 2), "logged", left_out)
    watch = monitor(logged, NET).observe(part.replace(domain=runs.domain, law=whole))
    assert "K = as declared, which 30 of 60 commands miss" in watch.details()


def test_runs_of_a_chain_on_a_smaller_k_are_of_another_law(claim):
    """Each of its manoeuvres draws from K: a true claim was refuted by those of a part of it."""
    runs, small = collect(plant(exact), KEY, 60, quiet=True), box([0.5, 0.0], [1.0, 1.0])
    chain = Chained(plant(exact), before=2, hand_over=(0.05, 1.0)).k_law
    of = derived(claim, law=replace(claim.law, k_law=chain))
    inside, law = small.contains(runs.k), replace(runs.law, k_law=chain)
    part = runs.select(inside).replace(domain=small, law=law_spec(law.generator, small, chain))
    with pytest.raises(InputError, match=r"got k by a chain .*, on another K\. Declare it"):
        monitor(of, NET).observe(part)
    assert monitor(of, NET, share=0.5).observe(part).seen == inside.sum()
    assert monitor(of, NET).observe(runs.replace(law=law)).seen == 60


def test_of_a_declared_law_one_run_of_each_recording_is_looked_at(claim):
    """It is of one run: the worst of 25, each of which leaves in 1 of 25 cases, nearly always."""
    p = np.array((runs := collect(plant(exact), KEY, 1000, quiet=True)).p)
    p[::25, -1] += 9.0
    law = law_spec("file:log", runs.domain, "uniform")
    about = {"time": runs.time, "domain": runs.domain, "law": law}
    log = rollout_batch(runs.k, p, runs.q, groups=np.arange(1000) // 25, **about)
    recordings = derived(claim, evidence={"rows": claim.n})
    worst = monitor(recordings, NET).observe(log)
    for declared in ({"share": 1.0}, {"density": 1.0}):
        watch = monitor(recordings, NET, **declared).observe(log)
        assert (worst.seen, worst.left, watch.seen) == (40, 40, 40) and watch.left < 9
        assert "= 1.0, of one run drawn from each" in watch.details() and not watch.alarm
    assert "one run drawn" not in worst.details() + monitor(claim, NET, share=1.0).details()


def test_what_is_no_argument_of_a_monitor_is_refused(claim):
    runs, watch = collect(plant(disturbed), KEY, 5, quiet=True), monitor(claim, NET)
    for bet in ("a", np.nan, 2, -1, 0.0, np.array([True, False]), np.array(1), [[True], []]):
        with pytest.raises(InputError, match=r"bet: expected True, False, None.* Got"):
            watch.bet(bet)
    for bet in (np.bool_(True), np.array(True), jnp.asarray(True)):
        assert watch.bet(bet).left == 1 and watch.bet(~bet).left == 0
    for call, words in (
        (lambda: monitor(NET, claim), "claim: expected ErrorClaim; got ReLUNetwork"),
        (lambda: monitor(claim, None), "net: expected ReLUNetwork; got None"),
        (lambda: watch.observe(None), "observe: expected RolloutBatch; got None"),
        (lambda: watch.observe(runs.select(slice(0))), "runs: expected at least one; got none"),
        (lambda: claim.risk(share=np.array([0.5, 0.5])), r"share: expected a number; got array"),
        (lambda: claim.risk(density=np.array([2, 2])), r"density: expected a number; got array"),
        (lambda: update(claim, NET, None, runs), "update seen: expected RolloutBatch; got None"),
        (lambda: update(claim, NET, runs, claim), "update fresh: expected RolloutBatch; got Err"),
    ):
        with pytest.raises(InputError, match=words):
            call()


def test_a_monitor_needs_a_rate(claim):
    assert monitor(claim, NET, share=0.25).rate == pytest.approx(0.08)
    for alpha in (0, 2.0, float("nan")):  # an alarm before the first run, or none ever
        with pytest.raises(InputError, match="alpha: expected"):
            monitor(claim, NET, alpha=alpha)
    with pytest.raises(InputError, match="one k"):
        monitor(claim, NET, density=None)
    with pytest.raises(InputError, match=r"got bin\. Leave it out: share=s"):
        monitor(claim, NET, share=0.25, bin=0)  # in which no run was looked for
    with pytest.raises(InputError, match="below 1/2"):
        monitor(claim, NET, share=0.01)
    with pytest.raises(InputError, match="assumed"):
        monitor(assumed_claim(NET, collect(plant(disturbed), KEY, 50, quiet=True)), NET)


def test_rows_that_a_log_lacks_are_counted(claim):
    """Every second run failed, and was left out; a log may come in parts."""
    runs = collect(plant(exact), KEY, 40, quiet=True)
    p = np.array(runs.p)
    p[::2, -1] = np.nan
    law = law_spec("file:log", runs.domain, claim.law.k_law)
    log = rollout_batch(runs.k, p, runs.q, time=runs.time, domain=runs.domain, law=law)
    watch, fit = monitor(claim, NET, share=1.0), log.select(~log.failed)
    with pytest.raises(InputError, match="expected runs with those that failed, each"):
        watch.observe(log.finite)
    assert [
        *watch.observe(runs)
        .observe(collect(plant(exact), jax.random.PRNGKey(9), 40, quiet=True))
        .missing.values()
    ] == [0, 0]  # of two seeds
    assert [*watch.observe(fit).missing.values()] == [20]
    assert [*watch.observe(log).missing.values()] == [0]
    first = watch.observe(log.select(slice(0, 15)))
    assert [*first.missing.values()] == [25]
    assert [*first.observe(log.select(slice(15, 40))).missing.values()] == [0]
    early = watch.observe(runs.select(slice(0, 15)))  # of a seed too, which has no end
    assert [*early.missing.values()] == [25]
    later = collect(plant(exact), KEY, 20, first_row=40, quiet=True)
    whole = early.observe(later).observe(runs.select(slice(15, 40)))
    assert whole.seen == 60 and [*whole.missing.values()] == [0]


def test_rows_that_never_come_have_failed_where_somebody_says_so(claim):
    """Left out as they failed, they were silent: nothing was bet on them, and nothing said."""
    runs = collect(plant(exact), KEY, 40, quiet=True)
    watch = monitor(claim, NET, share=1.0).observe(runs.select(slice(0, 15)))
    said = watch.details()
    assert not watch.alarm and said.startswith("No alarm. Of 15 runs, drawn from plant (k")
    assert "Rows that are not here, 25 of plant: nothing was bet on them. Those that fail" in said
    assert "at most 0.02. The bets won 1 of 1000 that ring" in said
    assert "rings with probability at most 0.001." in said and "k as declared: share = 1.0" in said
    closed = watch.closed()
    assert closed.alarm and (closed.seen, closed.left) == (40, 25)
    assert closed.details().startswith("ALARM: the claim is refuted. Of 40 runs, drawn from pl")
    assert "25 of them are rows that never came, each counted as failed." in closed.details()
    with pytest.raises(InputError, match=r"25 more came, .* or counted as failed by `closed`"):
        closed.observe(runs.select(slice(15, 40)))
    whole = watch.observe(runs.select(slice(15, 40)))
    assert whole.closed().details() == whole.details() and "not here" not in whole.details()
    groups = derived(claim, evidence={"rows": claim.n})
    with pytest.raises(InputError, match="expected runs, of which each row is one; 3 rows of rec"):
        replace(monitor(groups, NET, share=1.0), missing={("log", "0a"): 3}).closed()


def test_of_bins_without_a_claim_nothing_is_bet_and_no_share_reaches_into_them(claim):
    """Where k is above 0.6 nothing is claimed: of all of K a risk of eps was told, and rows that
    `observe` said to leave out counted as failed.
    """
    edges, bin_eps = [np.array([0.0, 0.6, 1.0]), claim.tube.edges[1]], (claim.eps, None)
    halves = [np.repeat(half, 2, axis=0) for half in (claim.tube.interval, claim.tube.final)]
    for half in halves:
        half[1] = np.inf
    evidence = claim.evidence | {"bin_share": ["3/5", "2/5"]}
    evidence["blocks"] = [{"n": claim.n, "discard": claim.discard}]
    words = f"in each claimed bin of K, a new rollout drawn from {claim.law.describe()} with k in"
    shown = {"tube": tube(edges, *halves), "bin_eps": bin_eps, "evidence": evidence}
    shown |= {"quantifier": f"{words} that bin"}
    open_one = derived(claim, **shown)
    assert open_one.risk(share=0.6).bound == open_one.eps / Fraction(0.6)  # the smaller share
    with pytest.raises(InputError, match=r"a share up to 0\.6, of bins claimed"):
        open_one.risk(share=1.0)
    with pytest.raises(InputError, match=r"up to 0\.6, of bins claimed; got 0\.60000013\."):
        open_one.risk(share=0.60000013)
    # blocks of two bins: each has the share of its block in evidence
    blocks = evidence | {"bin_share": ["1", "1"]}
    assert derived(open_one, evidence=blocks).claimed_share == Fraction(0.6)
    watch = monitor(open_one, NET)
    assert watch.rate == pytest.approx(float(open_one.eps) / 0.6)
    assert "of those in bins that have a claim" in watch.details()
    assert "discards, fixed beforehand: 0 at most in each block" in open_one.details()
    runs = collect(plant(exact), KEY, 40, quiet=True)
    seen = watch.observe(runs.select(runs.k[:, 0] < 0.6))
    with pytest.raises(InputError, match="closed: expected a claim about every bin of K"):
        seen.closed()


def test_what_was_trained_on_is_no_new_evidence():
    """Of a seed by its rows, of a log by content: the network was fitted to these."""
    made, system = {"eps": 0.1, "delta": 0.05, "bins": (1, 1), "quiet": True}, plant(disturbed)
    train = collect(system, KEY, 60, quiet=True)
    seeded = bound_error(NET, system, KEY, train=train, **made)
    law = law_spec("file:log", train.domain, "uniform")
    both = collect(system, jax.random.PRNGKey(4), 160, quiet=True)
    runs = both.k, both.p, both.q
    log = rollout_batch(*runs, time=both.time, domain=both.domain, law=law)
    logged = bound_error(NET, log.select(slice(60, 160)), None, train=log.select(slice(60)), **made)
    later = collect(system, KEY, 5, first_row=60 + 200, quiet=True)
    for claim, seen in ((seeded, train), (logged, log)):
        again = replace(claim, evidence=json.loads(json.dumps(claim.evidence)))  # of a file
        for one in (claim, again):
            with pytest.raises(InputError, match=r"its training runs, the first is row 3\."):
                monitor(one, NET, share=1.0).observe(seen.select(slice(3, 9)))
            with pytest.raises(InputError, match=r"its training runs, the first is row 3\."):
                update(one, NET, later, seen.select(slice(3, 9)))
    assert monitor(seeded, NET).observe(later).seen == 5
    with pytest.raises(InputError, match="100 of 160 are its calibration runs and 60 of 160 are"):
        monitor(logged, NET, share=1.0).observe(log)


def test_all_runs_that_a_claim_saw_are_no_new_evidence():
    """Its profile was learned from rows behind the training runs; the network of an update is the
    old one. What it does not name is assumed, and said.
    """
    made, system = {"eps": 0.1, "delta": 0.05, "bins": (1, 1), "quiet": True}, plant(disturbed)
    some = np.random.default_rng(0).permutation(60)[:40]  # as of a split
    train = collect(system, KEY, 60, quiet=True).select(some)
    claim = bound_error(NET, system, KEY, train=train, profile_runs=30, **made)
    first, other = int(train.rows.max()) + 1, jax.random.PRNGKey(2)
    rows = {
        "training": (KEY, some[0], 1),
        "profile": (KEY, first + 29, 1),
        "calibration": (KEY, claim.n - 1, 2),
    }

    def row(key, at, stage):
        return collect(system, key, 1, Stage(stage), first_row=int(at), quiet=True)

    fresh = collect(system, other, 60, Stage.BOUND, quiet=True)
    _, new = update(claim, NET, collect(system, other, 60, quiet=True), fresh)
    for one in (claim, new):
        for use, place in rows.items():
            with pytest.raises(InputError, match=f"1 of 1 are its {use} runs, the first is row"):
                monitor(one, NET, share=1.0).observe(row(*place))
        set_aside = np.setdiff1d(np.arange(60), some)[0]
        watch = monitor(one, NET, share=1.0).observe(row(KEY, set_aside, 1))
        watch = watch.observe(row(KEY, first + 30, 1))
        assert watch.seen == 2 and "FRESH" not in watch.details()
    with pytest.raises(InputError, match="1 of 1 are its training runs"):
        monitor(new, NET, share=1.0).observe(row(other, 0, 1))
    # of a file nobody can tell that it holds runs which the claim names by their seed
    log = fresh.replace(seed=None, stage=None)
    told = "none is a calibration or profile or training run of the claim beside 128 of each part"
    assert f"FRESH({told} of these, compared by" in monitor(claim, NET).observe(log).details()
    early = [entry[:5] for entry in claim.evidence["seen"]]  # as of a file without marks
    bare = monitor(derived(claim, evidence={"seen": early}), NET).observe(log)
    assert "FRESH(none is a profile or training run of the claim, none is a cali" in bare.details()
    _, new = update(claim, NET, collect(system, other, 60, quiet=True), log)
    before = "calibration or profile or training run of the claim before beside 128 of each part"
    copies = "each of q as much of its largest, would not be recognised"
    assert f"{copies}; none is a {before} of these" in new.details()
    _, new = update(claim, NET, stored(collect(system, other, 60, quiet=True)), log)
    assert f"would not be recognised; none is a {before} of these" in new.details()
    del made["bins"]  # the profile has them
    shape = bound_error(NET, system, KEY, profile=claim.tube, **made)
    said = monitor(shape, NET).details()
    whose = "whose network does not say what it was trained on"
    assert f"FRESH(none is a profile or training run of the claim, {whose})" in said


def test_a_monitor_of_a_claim_about_a_log_knows_near_copies_and_assumes_that_no_others_come():
    """Of runs in files, in a coarse rounding and of no uniform law, no test can tell that."""
    system = plant(disturbed)
    train, held = (collect(system, KEY, 60, stage, quiet=True) for stage in (1, 2))
    made = {"eps": 0.2, "delta": 0.1, "bins": (1, 1), "quiet": True}
    one = bound_error(NET, stored(held, "logged"), None, train=stored(train, "logged"), **made)
    watch = monitor(one, NET, share=1.0)
    with pytest.raises(InputError, match="60 of 60 are its calibration runs"):
        watch.observe(stored(held, "logged"))
    for use, runs in (("calibration", held), ("training", train)):
        with pytest.raises(InputError, match=f"60 of 60 are its {use} runs"):
            watch.observe(stored(runs, "logged", np.float32))
    fresh = stored(collect(system, jax.random.PRNGKey(9), 60, quiet=True), "logged")
    net, two = update(one, NET, stored(train, "logged"), fresh)  # trained on the same runs twice
    with pytest.raises(InputError, match="60 of 60 are its training runs"):
        monitor(two, net, share=1.0).observe(stored(train, "logged", np.float32))
    told = "none is a calibration or training run of the claim beside 128 of each part of these"
    assert f"FRESH({told}" in watch.observe(stored(held, "logged", np.float16)).details()


def stored(runs, k_law="uniform", dtype=np.float64, at=0.0):
    """Runs as from a file: k and p in this type, from another start."""
    p = (runs.p + at).astype(dtype) - np.asarray(at, dtype)
    k, law = runs.k.astype(dtype).astype(float), law_spec("file:log", runs.domain, k_law)
    return rollout_batch(k, p, runs.q, time=runs.time, domain=runs.domain, law=law)


FILES = {"exact": {}, "float32": {"dtype": np.float32}, "moved": {"dtype": np.float32, "at": 300.0}}


@pytest.mark.parametrize("copied", FILES)
def test_copies_in_files_of_runs_that_have_a_seed_are_no_new_evidence(claim, copied):
    """An update by the runs that the network was fitted to said 0.045 where 0.85 left the tube."""
    made, system = {"eps": 0.1, "delta": 0.05, "bins": (1, 1), "quiet": True}, plant(disturbed)
    train = collect(system, KEY, 200, quiet=True)
    one = bound_error(NET, system, KEY, train=train, profile_runs=90, **made)
    first, seen = int(train.rows.max()) + 1, collect(system, jax.random.PRNGKey(9), 60, quiet=True)
    uses = {
        "training": train,
        "profile": collect(system, KEY, 90, first_row=first, quiet=True),
        "calibration": collect(system, KEY, one.n, Stage.BOUND, quiet=True),
    }
    for use, runs in uses.items():
        log = stored(runs, **FILES[copied])
        known = min(128, runs.n)
        for meet in (monitor(one, NET).observe, partial(update, one, NET, seen)):
            with pytest.raises(InputError, match=f"{known} of {runs.n} are its {use} runs, the"):
                meet(log)
    other = stored(seen, **FILES[copied])  # of no part: new evidence, once
    watch = monitor(one, NET).observe(other)
    for again in (seen, *(stored(seen, **how) for how in FILES.values())):
        with pytest.raises(InputError, match=r"60 of 60 occur twice or were observed before"):
            watch.observe(again)
    assert watch.seen == 60
    ledger, (*about, _, marks) = [], entry_of("training", train)
    chunks = (train.select(slice(0, 90)), train.select(slice(90, 200)))
    assert sum(batch.n for batch in noted(ledger, "training", chunks)) == 200
    assert ledger == [[*about, [[0, 89], [90, 199]], marks]] and len(marks) == 128


def test_k_that_may_repeat_are_no_copies(claim):
    """The commands of a list that training drove too, driven again: of no uniform law."""
    system = plant(disturbed)
    train = collect(system, KEY, 60, quiet=True)
    one = bound_error(NET, system, KEY, train=train, eps=0.1, delta=0.05, bins=(1, 1), quiet=True)
    again = collect(system, jax.random.PRNGKey(7), 60, k=train.k, quiet=True)
    watch = monitor(one, NET, share=1.0).observe(again)
    later = collect(system, jax.random.PRNGKey(8), 60, k=train.k, quiet=True)
    assert watch.observe(later).seen == 120
    with pytest.raises(InputError, match="60 of 60 are its training runs, the"):
        watch.observe(stored(train, "logged"))


def test_few_values_of_k_are_equal_by_chance():
    """Of a narrow K far from zero float32 tells hundreds of values apart, not millions."""
    rng = np.random.default_rng(0)
    k = [rng.uniform(1000, 1000.02, (1000, 1)) for _ in range(2)]

    def runs(k, domain):
        law = law_spec("file:log", domain, "uniform")
        return SimpleNamespace(k=k, n=len(k), law=law, subject=SimpleNamespace(domain=domain))

    assert not repeated(runs(k[0], box([1000.0], [1000.02])), marks_by_k(k[1])).any()
    wide = runs(k[0] - 1000, box([0.0], [0.02]))
    assert repeated(wide, marks_by_k(wide.k[:3])).sum() == 3


def test_a_run_alone_is_recognised_by_its_k(claim):
    """How wide K is says how rare equal k are; one run, or some of equal k, span nothing."""
    runs = collect(plant(disturbed), KEY, 60, quiet=True)
    watch = monitor(claim, NET).observe(stored(runs))
    alone = stored(runs.select(slice(7, 8)), **FILES["moved"])
    with pytest.raises(InputError, match="1 of 1 occur twice or were observed before"):
        watch.observe(alone)
    assert watch.observe(stored(collect(plant(disturbed), KEY, 1, first_row=60, quiet=True))).seen


def test_each_premise_of_a_monitor_is_in_its_sentence(claim):
    runs = collect(plant(exact), KEY, 40, quiet=True)
    runs = runs.replace(lost=np.arange(40) % 2)
    claim = derived(claim, evidence={"seen": []})
    watch = monitor(claim, NET).observe(runs.select(slice(0, 15))).bet(False)
    assert (
        "TOLD(1 by `bet`, not looked at, each that stayed followed to its end, a shield's"
        in watch.details()
    )
    assert "TOLD" not in monitor(claim, NET).observe(runs).details()
    of = lambda other: {"claim": other, "of": other.hash}  # noqa: E731
    changed = {
        "claim": of(derived(claim, evidence={"another": "claim"})),
        "rate": {"rate": 0.03},
        "alpha": {"alpha": 0.01},
        "seen": {"seen": 17},
        "left": {"left": 1},
        "laws": {"laws": frozenset()},
        "largest": {"peak": 7.0},
        "alarm": {"peak": 1e4},
        "counted as failed": {"failed": 1},
        "LAW": {"declared": "k as declared: share = 0.5"},
        "TOLD": {"ids": watch.ids | {b"one more"}},
        "FRESH": of(derived(claim, evidence={"seen": [["training", "", None, None, []]]})),
        "MISSING": {"missing": {}},
        "ORDER_OF_K": {"unnamed": False},
        "WORKERS_LOST": {"lost": ("uncounted",)},
    }
    assert {entry.name for entry in watch.premises} == changed.keys()
    assert "WORKERS_LOST(7, independent of the run)" in watch.details()
    for name, change in changed.items():
        assert replace(watch, **change).details() != watch.details(), name


def test_manoeuvres_that_are_told_are_no_recordings(claim):
    """Of a claim about recordings 40 manoeuvres of one drive were told of as 40 recordings."""
    watch = monitor(derived(claim, evidence={"rows": claim.n}), NET, share=1.0).bet(False)
    assert "Of 1 recording or manoeuvre, " in watch.details()
    assert repr(watch) == "<Monitor: no alarm, of 1 recording or manoeuvre 0 left the tube>"
    assert ", of 2 recordings and manoeuvres 0 left" in repr(watch.bet(False))
    assert (
        "INDEPENDENT(each that is told by `bet` is a new recording of its own)" in watch.details()
    )
    assert "INDEPENDENT" not in monitor(claim, NET).bet(False).details()


def test_a_run_that_was_cut_short_is_no_run_that_stayed(claim):
    """The first 1 % of a manoeuvre that stayed was told as a run that stayed."""
    watch = monitor(claim, NET)
    for outside, followed in ((False, 0.01), (False, 1.0), (True, 0.3), (False, 0.02)):
        watch = watch.bet(outside, followed)
    assert (watch.seen, watch.left) == (4, 1)
    told = "TOLD(4 by `bet`, not looked at, 2 that stayed followed for 1.5 % of their time alone,"
    assert told in watch.details()
    for wrong in (1.01, 50, -0.1, np.nan, True, "all"):
        with pytest.raises(InputError, match="bet: "):
            watch.bet(False, wrong)


def test_a_run_of_which_nobody_knows_is_counted_and_wins_nothing(claim):
    """It had to be told as one that stayed, or not at all."""
    watch = monitor(claim, NET).bet(None, 0.3).bet(True)
    assert (watch.seen, watch.left) == (2, 1)
    assert watch.e_value == monitor(claim, NET).bet(False).bet(True).e_value
    said = "of 2 runs (1 of which nobody knows whether they left, no win of a bet) 1 left"
    assert said in repr(watch) and said.replace("of", "Of", 1)[:20] in watch.details()
    assert "followed to its end, a shield's seen at its steps alone" in watch.details()
    assert replace(watch, unknown=0).details() != watch.details()


def test_the_bets_of_a_monitor_are_against_its_own_claim(claim):
    """Another one, or a half of one, was told as refuted, or as not, by bets against this one."""
    watch = monitor(claim, NET)
    other = derived(claim, evidence={"another": "claim"})
    with pytest.raises(InputError, match="expected the claim against which its bets were made"):
        replace(watch, claim=other)
    tenth = replace(claim, eps=claim.eps / 10)
    for make in (lambda: monitor(tenth, NET), lambda: replace(watch, claim=tenth)):
        with pytest.raises(InputError, match="that it was made about"):
            make()
    with pytest.raises(InputError, match="expected the network its claim was measured on"):
        replace(watch, net=straight_network(5))


def test_new_data_gives_a_new_claim(claim):
    shifted = plant(partial(disturbed, scale=2.0), name="icy")
    seen = collect(shifted, KEY, 400, quiet=True)
    fresh = collect(shifted, KEY, 400, 2, quiet=True)
    net, new = update(claim, NET, seen, fresh, bins=(1, 1))
    assert (
        net is NET
        and (new.eps, new.discard) == (claim.eps, most_discards(400, 0.02, 1e-3))
        and new.tube.interval.max() > 1.5 * claim.tube.interval.max()
    )
    assert new.law.generator == "icy" and new.evidence["updated_from"]["n"] == claim.n
    _, small = update(claim, NET, seen, fresh.select(slice(100)), bins=(1, 1))
    assert small.eps > claim.eps  # what a hundred runs support
    with pytest.raises(InputError, match="training runs"):
        update(claim, NET, seen, seen, bins=(1, 1))


def test_bets_that_ring_are_told_above_those_that_were_won(claim):
    """They were told as 865 of 865, and no alarm."""
    peak = monitor(claim, NET).bet(True).peak
    watch = monitor(claim, NET, alpha=1 / (1.0004 * peak)).bet(True)
    won, ring = re.search(r"won (\S+) of (\S+) that ring", watch.details()).groups()
    assert not watch.alarm and float(won) <= watch.peak < 1 / watch.alpha <= float(ring)


def test_an_alarm_is_told_with_no_fewer_bets_won_than_ring(claim):
    """They were told as 333 of 334, with an alarm."""
    peak = monitor(claim, NET).bet(True).peak
    watch = monitor(claim, NET, alpha=1 / (0.99999 * peak)).bet(True)
    won, ring = re.search(r"won (\S+) of (\S+) that ring", watch.details()).groups()
    assert watch.alarm and float(ring) <= float(won) <= watch.peak
