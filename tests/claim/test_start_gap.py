"""How much the start matters: refused when a trial sees more than declared, added to the tube,
named in the claim.
"""

import itertools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from profiles import training_profile
from synthetic_plants import noisy, plant, straight_network
from toy_models import line_model
from toy_running import Cart
from turning_arc import Arc

import parc_jax as pj
from parc_jax.app.study.settings import Study
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage, generator
from parc_jax.drive.local.trials import ledger_of_tests
from parc_jax.learning.bound.calibrate import calibrate
from parc_jax.learning.bound.monitor import inside_tube
from parc_jax.learning.bound.pipeline import bound_error
from parc_jax.learning.bound.settings import ModelBound
from parc_jax.learning.bound.start_gap import (
    MOVED,
    StartTrial,
    allow_for_start,
    declared_gap,
    try_starts,
)
from parc_jax.learning.learn import learn
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.law import law_spec
from parc_jax.learning.system import TURNS, Trajectory
from parc_jax.learning.systems.chained import chained

KEY = jax.random.PRNGKey(3)
STUDY = Study(
    hidden=(3,),
    rollouts=40,
    seeds=1,
    steps=20,
    bound=ModelBound(bins=(1, 1), eps=0.2, delta=0.2, gap=0.02),
)


class Hill:
    """Pushed aside by what the start's first coordinate says, at most `size` [m]: it violates
    invariance, a little.
    """

    def __init__(self, size: float):
        base = plant(noisy)
        self.name, self.domain, self.time, self.n_p, self.n_q = "hill", base.domain, base.time, 2, 1
        self.flat, self.size = base.rollout, size

    def rollout(self, key, k):
        return self.rollout_from(key, k, jnp.zeros(2, k.dtype))

    def rollout_from(self, key, k, p0):
        p, q = self.flat(key, k)
        push = self.size * jnp.sin(p0[0])
        return Trajectory(
            p + push * jnp.linspace(0.0, 1.0, len(p), dtype=p.dtype)[:, None], q + push
        )


def test_a_start_that_matters_more_than_declared_is_refused_with_its_size(tmp_path):
    with pytest.raises(
        InputError, match=r"more than 0.02; moving the start by up to .* m moved the offsets by 0.0"
    ):
        learn(Hill(0.1), KEY, settings=STUDY, quiet=True)
    with pytest.raises(InputError, match="a number >= 0"):
        try_starts(Hill(0.0), KEY, float("nan"))
    assert try_starts(Hill(0.0), KEY, 0.0).seen == 0.0


def gust(rng, k):
    """Rolls with the commanded velocity, and is pushed aside by a gust."""
    t = np.linspace(0.0, 1.0, 5)[:, None]
    return t * (k + 0.1 * rng.normal(size=2)), []


def gust_of_the_fast(rng, k):
    """Most k show nothing."""
    return (gust if k[0] > 0.6 else gust_of_one_seed)(rng, k)


def gust_of_one_seed(rng, k):
    """`env.reset(seed=0)`, as every tutorial has it."""
    return gust(np.random.default_rng(0), k)


@pytest.mark.parametrize("simulate", [gust, gust_of_the_fast, gust_of_one_seed])
def test_runs_that_no_key_changes_are_told_of(simulate):
    """One gust in all runs: eps 0.01 was told, where the truth was 0.37."""
    time, K = pj.learning.time_grid(0.5, 1.0, 0.25), pj.box([0.5, -0.3], [1.0, 0.3])
    cart = pj.python_system(simulate, K, time, name="cart", n_p=2, workers=0)
    net = pj.learning.relu_network([np.kron([[0.5], [1.0]], np.eye(2))], [np.zeros(4)])
    claim = pj.learning.bound_error(net, cart, KEY, eps=0.2, delta=0.2, quiet=True)
    told = "NO_DISTURBANCE(of 8 k, runs of each under two keys are the same to the last bit)"
    assert (told in claim.details()) == (simulate is gust_of_one_seed)
    assert (told in ledger_of_tests(claim, np.zeros(20))) == (simulate is gust_of_one_seed)
    seen, fresh = (pj.learning.collect(cart, jax.random.PRNGKey(i), 30, quiet=True) for i in (5, 6))
    _, after = pj.learning.update(claim, net, seen, fresh)
    # the system of that name may be another one since, in which something changes
    told = f"{told[:-1]}; tried before an update)"
    assert (told in after.details()) == (simulate is gust_of_one_seed)


def test_a_system_in_jax_that_reads_no_key_is_told_of():
    class Gusts:
        def __init__(self, one_key):
            self.one_key = one_key

        domain = pj.box([0.5, -0.3], [1.0, 0.3])
        time = pj.learning.time_grid(0.5, 1.0, 0.25)
        name, n_p, n_q = "gusts", 2, 0

        def rollout(self, key, k):
            gust = jax.random.uniform(jax.random.PRNGKey(0) if self.one_key else key, (2,))
            return pj.Trajectory(jnp.outer(jnp.linspace(0.0, 1.0, 5), k + gust), k[:0])

    class OfPython(Gusts):
        """Which no key decides, and no trace shows."""

        dtype = np.float32  # threads that JAX calls Python from know of no context for float64

        def rollout(self, key, k):
            shape = jax.ShapeDtypeStruct((2,), k.dtype)
            gust = jax.pure_callback(lambda: np.random.default_rng().random(2, k.dtype), shape)
            return super().rollout(key, k + gust)

    class HandedOver(Gusts):
        """Whose callback draws nothing."""

        dtype = np.float32

        def rollout(self, key, k):
            p, q = super().rollout(key, k)
            jax.debug.print("q {}", q)
            return pj.Trajectory(jax.pure_callback(np.sin, p, p, vmap_method="sequential"), q)

    class OfBatches(Gusts):
        """One gust for all runs of a call, in NumPy."""

        def rollout_batch(self, keys, k):
            moved = np.asarray(k) + np.random.default_rng().random(2)
            return pj.Trajectory(np.linspace(0.0, 1.0, 5)[:, None] * moved[:, None], moved[:, :0])

    assert not try_starts(OfBatches(True), KEY, 0.0).alike
    with pytest.raises(InputError, match=r"gusts: expected runs to repeat .* from the key"):
        try_starts(OfPython(False), KEY, 0.0)  # one gust for all runs of a call, beside their own
    for made, none in itertools.product((Gusts, HandedOver), (True, False)):
        system = made(none)
        assert try_starts(system, KEY, 0.0).alike == 8 * none
        claim = allow_for_start(line_model(4, 0.1).claim, try_starts(system, KEY, 0.0))
        assert ("NO_DISTURBANCE" in claim.details()) == none


def test_runs_that_fail_under_every_key_hide_no_other():
    def simulate(rng, k):
        p, q = gust_of_one_seed(rng, k)
        return (p + np.nan if k[1] > 0.0 else p), q

    time, K = pj.learning.time_grid(0.5, 1.0, 0.25), pj.box([0.5, -0.3], [1.0, 0.3])
    cart = pj.python_system(simulate, K, time, name="cart", n_p=2, workers=0)
    assert try_starts(cart, KEY, 0.0).alike


@pytest.mark.parametrize("lost", [0.0, np.nan])
def test_keys_may_matter_in_some_runs_alone(lost):
    """A gust where k[1] > 0.1, or no run at all there, now and then: the first k has none."""

    def simulate(rng, k):
        p, q = gust_of_one_seed(rng, k)
        return (p + 1.0 + lost if k[1] > 0.1 and rng.random() < 0.5 else p), q

    time, K = pj.learning.time_grid(0.5, 1.0, 0.25), pj.box([0.5, -0.3], [1.0, 0.3])
    cart = pj.python_system(simulate, K, time, name="cart", n_p=2, workers=0)
    trial = try_starts(cart, KEY, 0.0)
    assert not trial.alike and trial.said_in(()) == ()


def test_where_no_run_comes_to_an_end_keys_change_none():
    """None was compared, and all were told to be the same to the last bit."""

    def simulate(rng, k):
        return np.full((5, 2), np.nan), []

    time, K = pj.learning.time_grid(0.5, 1.0, 0.25), pj.box([0.5, -0.3], [1.0, 0.3])
    cart = pj.python_system(simulate, K, time, name="cart", n_p=2, workers=0)
    trial = try_starts(cart, KEY, 0.0)
    assert not trial.alike and trial.said_in(()) == ()


def test_starts_whose_runs_come_to_no_end_are_not_told_to_have_been_compared():
    """ "0 seen from 8 starts", of which one was compared."""

    def simulate_from(rng, k, p0):
        p, q = gust(rng, k)
        return (p + np.nan if k[0] > 0.65 else p), q

    def simulate(rng, k):
        return simulate_from(rng, k, np.zeros(2))

    time, K = pj.learning.time_grid(0.5, 1.0, 0.25), pj.box([0.5, -0.3], [1.0, 0.3])
    about = {"name": "cart", "n_p": 2, "workers": 0, "simulate_from": simulate_from}
    cart = pj.python_system(simulate, K, time, **about)
    trial = try_starts(cart, KEY, 0.0)
    k = generator(KEY).uniform(K.lo, K.hi, (8, 2))
    failed = collect(cart, KEY, 8, Stage.SEARCH, k=k, quiet=True).failed
    number = ("no", "one", "two", "three", "four", "five", "six", "seven")[8 - int(failed.sum())]
    claim = allow_for_start(replace(line_model(4, 0.1).claim, assumptions=("IID", MOVED)), trial)
    assert 0 < failed.sum() < 8 and claim.assumptions == (
        "IID",
        f"{MOVED}(within 0; 0 seen from 8 starts, {number} of them compared)",
    )
    assert claim.premises  # its numbers are those of the evidence


def test_of_runs_of_another_law_no_trial_before_an_update_is_told():
    """Runs of one k ended 10 cm apart, and "NO_DISTURBANCE" stood beside."""
    time, K = pj.learning.time_grid(0.5, 1.0, 0.25), pj.box([0.5, -0.3], [1.0, 0.3])

    def cart(simulate, name="cart", law=None):
        return pj.python_system(simulate, K, time, name=name, n_p=2, workers=0, law=law)

    net = pj.learning.relu_network([np.kron([[0.5], [1.0]], np.eye(2))], [np.zeros(4)])
    still = cart(gust_of_one_seed)
    claim = pj.learning.bound_error(net, still, KEY, eps=0.2, delta=0.2, quiet=True)
    seen = pj.learning.collect(still, jax.random.PRNGKey(5), 30, quiet=True)
    others = still, cart(gust, law={"gust": "0.1 m"}), cart(gust, "windy cart")
    for other in others:
        fresh = pj.learning.collect(other, jax.random.PRNGKey(6), 30, quiet=True)
        said = pj.learning.update(claim, net, seen, fresh)[1].details()
        assert ("NO_DISTURBANCE" in said) == (other is still)


def test_a_run_from_elsewhere_with_another_heading_is_off_twice_and_stays_inside():
    """Each deviation is as large as declared, and both go one way: the tube holds their sum."""
    batch = replace(collect(plant(noisy), KEY, 60, Stage.BOUND, quiet=True), rotation=(TURNS,))
    net = straight_network(4)
    profile = training_profile(net, collect(plant(noisy), KEY, 60, quiet=True), (1, 1))
    claim = calibrate(net, batch, profile, eps=0.1, delta=0.1, discard=0)
    assert claim.assumptions[1:3] == ("TRANSLATION_INVARIANCE", "ROTATION_INVARIANCE")
    wider = allow_for_start(claim, StartTrial(0.02, None, 2.0**-43))
    assert wider.assumptions[1:3] == (
        "TRANSLATION_INVARIANCE(within 0.02; not measured)",
        "ROTATION_INVARIANCE(within 0.02; 1.13687e-13 seen from 8 headings)",
    )
    ramp = np.minimum(np.linspace(0.0, 4.0, batch.p.shape[1]), 1.0)[None, :, None]
    for way in (1.0, -1.0):
        off = way * 2 * 0.02
        moved = replace(batch, p=batch.p + off * ramp, q=batch.q + off)
        assert inside_tube(wider, net, moved).all()
    still = calibrate(net, replace(batch, rotation=None), profile, eps=0.1, delta=0.1, discard=0)
    assert "ROTATION_INVARIANCE" not in " ".join(still.assumptions)
    logged = replace(batch, law=law_spec("file:log.npz", batch.domain, "logged"))
    logged = calibrate(net, logged, profile, eps=0.1, delta=0.1, discard=0)
    assert "BEGINS_WITH_HEADING_0" in logged.assumptions  # no run shows it, where one point is seen
    assert "BEGINS_WITH_HEADING_0" not in claim.assumptions
    once = allow_for_start(still, StartTrial(0.02, None)).tube
    np.testing.assert_allclose(wider.tube.interval - once.interval, 0.02, atol=1e-12)
    assert (wider.tube.final >= once.final + 0.02 - 1e-12).all()
    exact = allow_for_start(still, StartTrial(0.02, 0.0))  # no difference at all is a number too
    assert "(within 0.02; 0 seen from 8 starts)" in exact.details()


def test_headings_are_tried_with_the_starts():
    trial = try_starts(Arc(0.0), KEY, 1e-9)
    assert trial.seen is None and trial.turned < 1e-9
    with pytest.raises(InputError, match="runs that turn with their heading"):
        bound_error(straight_network(4), Arc(0.1), KEY, eps=0.1, delta=0.1, gap=1e-3, quiet=True)
    other, of_start = Arc(0.0), Arc(0.0)
    other.rollout, other.rollout_headed = of_start.rollout, lambda key, k: of_start.rollout(key, k)
    with pytest.raises(InputError, match=r"rollout_headed\(.*\) to run; it fails: TypeError"):
        try_starts(other, KEY, 1e-9)


class Elsewhere(Hill):
    """Whose runs from a start are made by another robot, or never come to an end."""

    def rollout(self, key, k):
        return self.flat(key, k)

    def rollout_from(self, key, k, p0):
        return jax.tree.map(lambda x: self.size * x, self.flat(key, k))


@pytest.mark.parametrize(("size", "words"), [(2.0, "differ by"), (np.nan, "are not finite")])
def test_a_trial_by_other_runs_than_the_system_s_is_refused(size, words):
    """Both had "0 seen from 8 starts"."""
    with pytest.raises(InputError, match=rf"expected rollout_from.* to make from zero .*{words}"):
        try_starts(Elsewhere(size), KEY, 0.02)


def test_runs_of_a_system_in_float32_are_compared_in_float32_where_its_draws_are_its_own():
    class Single(Hill):
        dtype = np.float32

        def rollout_from(self, key, k, p0):
            p, q = super().rollout_from(key, k, p0)
            away = 0.1 * jax.random.normal(key, (), k.dtype)
            return Trajectory(p + away * jnp.linspace(0.0, 1.0, len(p), dtype=p.dtype)[:, None], q)

    assert try_starts(Single(1e-3), KEY, 0.02).seen < 0.02
    other = Elsewhere(0.5)
    other.dtype = np.float32
    with pytest.raises(InputError, match="to make from zero"):
        try_starts(other, KEY, 0.02)


def test_of_a_chain_whose_trial_would_begin_at_rest_nothing_is_measured():
    class Offers(Cart):
        def rollout_from(self, key, k, p0):
            return self.rollout(key, k)

    trial = try_starts(chained(Offers(), 2, (0.2, 0.6)), KEY, 0.02)
    assert "not measured" in trial.said_in(["TRANSLATION_INVARIANCE"])[0]


def test_a_system_that_cannot_start_elsewhere_says_so():
    trial = try_starts(plant(noisy), KEY, 1e-3)
    assert trial.seen is None and trial.turned is None
    claim = replace(line_model(4, 0.1).claim, assumptions=("IID", "TRANSLATION_INVARIANCE", "X"))
    wider = allow_for_start(claim, trial)
    assert wider.assumptions == ("IID", "TRANSLATION_INVARIANCE(within 0.001; not measured)", "X")
    np.testing.assert_allclose(wider.tube.interval - claim.tube.interval, 1e-3, rtol=0, atol=1e-15)
    assert (wider.tube.final - claim.tube.final >= 1e-3 - 1e-17).all()


def test_a_gap_that_is_a_number_is_of_an_earlier_form():
    claim = allow_for_start(line_model(4, 0.1).claim, try_starts(plant(noisy), KEY, 1e-3))
    assert declared_gap(claim) == 1e-3
    with pytest.raises(InputError, match="gap as text"):
        declared_gap(replace(claim, evidence={"start": {"gap": 0.001}}))
