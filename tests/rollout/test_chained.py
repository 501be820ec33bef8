"""Chained runs: each begins in what manoeuvres before it left behind, and claims about them hold
where claims about settled starts do not.
"""

from fractions import Fraction

import jax
import numpy as np
import pytest
from scored import score_batch
from toy_running import DRIVE, LAG, ROUGH, Cart, Carts, H, settled_network

import parc_jax as pj
from parc_jax.app.study.replay import replay
from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.runs.law import told_of_part
from parc_jax.learning.system import Retried, Trajectory
from parc_jax.learning.systems.chained import _pick, hand_over_of

KEY = jax.random.PRNGKey(0)
CART, CARTS = Cart(), Carts()
CHAIN = pj.learning.chained(CART, 2, (0.2, 0.6))


@pytest.fixture(scope="module")
def runs():
    return collect(CHAIN, KEY, 64, quiet=True)


class Batch:
    """The same cart, many at a time, in NumPy. k = (speed, command under way, next command): it
    goes on with the one under way for 0.25 s, as long as a planner may think. [T37d]
    """

    name, n_p, n_q = "thoughtful", 2, 0
    domain = pj.box([0.0] * 3, [1.0] * 3)
    time = Cart.time
    given = (0, 1)

    def start_state(self, keys):
        return np.zeros((len(keys), 3))

    def measured(self, states):
        return states[..., [0, 2]]

    def rollout_batch(self, keys, ks):
        states = np.stack([ks[:, 0], ks[:, 0], ks[:, 1]], axis=1)
        return self.rollout_from_state(keys, states, ks)[0]

    def rollout_from_state(self, keys, states, ks):
        states, p = [np.asarray(states)], [np.zeros((len(ks), 2))]
        for record in range(self.time.n_record):
            speed, drive, under_way = states[-1].T
            command = under_way if record < 5 else np.asarray(ks)[:, 2]
            speeds = speed + H * (drive - speed) / LAG, drive + H * (command - drive) / DRIVE
            p.append(p[-1] + np.stack([H * speed, 0 * speed], axis=1))
            states.append(np.stack([*speeds, command], axis=1))
        return Trajectory(np.stack(p, axis=1), np.zeros((len(ks), 0))), np.stack(states, axis=1)


def test_a_manoeuvre_that_was_made_again_counts_whichever_of_its_chain_it_is():
    class Loses(Batch):
        def rollout_from_state(self, keys, states, ks):
            (p, q), along = super().rollout_from_state(keys, states, ks)
            return Retried(p, q, np.arange(len(ks)) % 2), along

    made = collect(pj.learning.chained(Loses(), 2, (0.2, 0.6)), KEY, 16, quiet=True)
    assert made.lost.tolist() == [0, 3] * 8  # once in each of three manoeuvres


@pytest.mark.slow  # compiles chains of its own
@pytest.mark.parametrize("where", ["start_state", "measured", "rollout_from_state"])
def test_what_is_drawn_once_as_a_chain_is_compiled_is_refused(where):
    """Wherever in it, though `rollout` alone draws nothing."""

    def gust(name):
        return float(np.random.default_rng().uniform(0, 0.1)) if name == where else 0.0

    class Gusty(Cart):
        def start_state(self, key):
            return super().start_state(key) + gust("start_state")

        def measured(self, state):
            return super().measured(state) + gust("measured")

        def rollout(self, key, k):
            return super().rollout_from_state(key, k, k)[0]

        def rollout_from_state(self, key, state, k):
            (p, q), states = super().rollout_from_state(key, state, k)
            return Trajectory(p * (1 + gust("rollout_from_state")), q), states

    with pytest.raises(InputError, match="another each time it is compiled"):
        collect(pj.learning.chained(Gusty(), 2, (0.2, 0.6)), KEY, 8, quiet=True)


@pytest.mark.slow  # traced: compiles a chain of its own
def test_a_run_is_the_last_of_its_chain(runs):
    """Told from its own start, from a speed that a drive in motion left behind."""
    assert runs.law.k_law == "a chain of 2 manoeuvres before it, each left after 0.2 to 0.6 s"
    for law in (runs.law, told_of_part(runs.law)):  # also where plans choose from less than K
        assert hand_over_of(law.k_law) == (Fraction(1, 5), Fraction(3, 5))
    assert runs.given == (0,) and not runs.failed.any() and (runs.p[:, 0] == 0).all()
    np.testing.assert_allclose(runs.p[:, 1, 0], H * runs.k[:, 0], rtol=1e-12)
    change = (runs.p[:, 2, 0] - 2 * runs.p[:, 1, 0]) / H  # [m/s] in the first step
    assert (np.abs(change) > H * 3 * ROUGH / LAG).mean() > 0.7
    assert 0.3 < runs.k[:, 1].mean() < 0.7


@pytest.mark.slow  # traced: compiles a chain of its own
def test_rows_depend_on_their_number_alone_and_a_stored_file_goes_on(runs, tmp_path):
    others = collect(CHAIN, KEY, 24, first_row=40, quiet=True)
    assert np.array_equal(others.p, runs.p[40:]) and np.array_equal(others.k, runs.k[40:])
    kept = collect(CHAIN, KEY, 64, path=tmp_path / "runs.npz", quiet=True)
    again = collect(CHAIN, KEY, 64, path=tmp_path / "runs.npz", quiet=True)
    assert np.array_equal(kept.p, again.p) and again.law == runs.law
    with pytest.raises(InputError, match="law"):
        collect(CART, KEY, 64, path=tmp_path / "runs.npz", quiet=True)


def test_a_claim_about_settled_starts_is_left_by_running_ones_and_one_about_chains_is_not():
    """Both are true of their own law of starts; in use the robot comes from other manoeuvres."""
    net, asked = settled_network(), dict(eps=0.1, delta=0.01, bins=(2, 2))
    settled = pj.learning.bound_error(net, CARTS, KEY, **asked, quiet=True)
    chained = pj.learning.bound_error(net, pj.learning.chained(CARTS), KEY, **asked, quiet=True)
    assert "HIDDEN_START(given v0)" in settled.assumptions
    assert "k by a chain of 3 manoeuvres before it" in chained.details()
    assert isinstance(chained.risk(), pj.types.NoStatement)

    def left(claim, system):
        fresh = collect(system, KEY, 256, Stage.VALIDATE, quiet=True)
        return (score_batch(net, fresh, claim.tube).score > 1).mean()

    longer = pj.learning.chained(CARTS, 6)
    assert left(settled, CARTS) <= 0.1 < 0.5 < left(settled, longer)
    assert left(chained, longer) <= 0.1


@pytest.mark.slow  # a chain of its own
def test_a_system_in_batches_and_a_command_under_way():
    """The command under way is measured like the speed: it is the one of the manoeuvre before."""
    chain = pj.learning.chained(Batch(), 2, (0.5, 1.0))
    runs = collect(chain, KEY, 400, quiet=True)
    assert runs.given == (0, 1) and runs.law.generator == "thoughtful"
    assert np.corrcoef(runs.k[:, 0], runs.k[:, 1])[0, 1] > 0.5
    assert abs(np.corrcoef(runs.k[:, 1], runs.k[:, 2])[0, 1]) < 0.2
    assert abs(runs.k[:, 1].mean() - 0.5) < 0.1
    alike = collect(Batch(), KEY, 10, quiet=True)
    same = alike.k.copy()
    same[:, 2] = 0.5
    slow, fast = (collect(Batch(), KEY, 10, k=x, quiet=True).p for x in (alike.k, same))
    assert np.array_equal(slow[:, :6], fast[:, :6]) and not np.array_equal(slow, fast)


def test_records_are_picked_evenly_among_those_that_fit():
    fits = np.tile([False, True, False, True, True], (3000, 1))
    share = (np.arange(3000) + 0.5) / 3000
    picked = _pick(CHAIN, fits, share)
    assert np.bincount(picked).tolist() == [0, 1000, 0, 1000, 1000]
    assert (_pick(CHAIN, fits[:2], np.array([0.0, np.nextafter(1, 0)])) == [1, 4]).all()


@pytest.mark.slow  # a chain of its own
def test_what_is_measured_may_leave_k_and_come_back_but_not_for_good():
    narrow = type("Narrow", (Carts,), {"domain": pj.box([0.0, 0.0], [0.4, 1.0])})()
    runs = collect(pj.learning.chained(narrow), KEY, 64, quiet=True)
    assert runs.k[:, 0].max() <= 0.4 and (runs.k[:, 0] > 0.3).any()
    np.testing.assert_allclose(runs.p[:, 1, 0], H * runs.k[:, 0], rtol=1e-12)
    never = type("Never", (Carts,), {"domain": pj.box([0.5, 0.0], [1.0, 1.0])})()
    with pytest.raises(InputError, match=r"measured \(v0 .* 64 of 64 chains never came back to it"):
        collect(pj.learning.chained(never), KEY, 64, quiet=True)


@pytest.mark.parametrize(
    ("system", "options", "sentence"),
    [
        (
            type("No", (Cart,), {"given": ()})(),
            {},
            "expected cart to declare `given` .* lacks given",
        ),
        (type("No", (Cart,), {"measured": None})(), {}, "it lacks measured"),
        (Cart(), {"before": 0}, "before: expected a whole number >= 1"),
        (Cart(), {"before": 1.5}, "before: expected a whole number >= 1"),
        (Cart(), {"hand_over": (0.0, 0.5)}, "two times in .0, 1. s"),
        (Cart(), {"hand_over": (0.5, 1.5)}, "two times in .0, 1. s"),
        (Cart(), {"hand_over": (0.51, 0.54)}, "with a record between them"),
        (Cart(), {"hand_over": 0.5}, "hand_over: expected shape"),
        (Cart(), {"hand_over": ("a", "b")}, "hand_over: expected numbers"),
    ],
)
def test_what_cannot_be_chained_is_refused(system, options, sentence):
    with pytest.raises(InputError, match=sentence):
        pj.learning.chained(system, **options)


def test_states_at_the_end_alone_are_refused():
    def at_the_end(self, key, state, k):
        trajectory, states = Carts.rollout_from_state(self, key, state, k)
        return trajectory, states[:, -1:]

    odd = type("Odd", (Carts,), {"rollout_from_state": at_the_end})()
    with pytest.raises(InputError, match="states at 21 records"):
        collect(pj.learning.chained(odd), KEY, 4, quiet=True)


@pytest.mark.slow  # asks a planner of three claims
def test_runs_of_one_plan_are_refused_where_the_claim_or_the_system_is_about_chains():
    """They begin settled, as if nothing came before: their count says nothing of the next run."""
    chain, net, local = pj.learning.chained(CARTS), settled_network(), pj.drive.Local(rollouts=50)
    asked = dict(eps=0.1, delta=0.01, bins=(2, 2), quiet=True)
    free = pj.Uncertainty(given={"v0": "free"})
    scene = pj.reach_avoid(pj.box([-9.0] * 2, [9.0] * 2), [], 0.1, uncertainty=free)
    for claimed, driven in ((CARTS, chain), (chain, chain), (chain, CARTS)):
        claim = pj.learning.bound_error(net, claimed, KEY, **asked)
        planner = pj.Planner(pj.learning.trajectory_model(net, claim))
        answer = planner.solve(scene, KEY, pj.Settings(samples=1, target=0.1))
        assert "v0 is measured at the start, and drawn by nobody" in answer.summary()
        plan = answer.choose(looks=2)
        assert "drawn by nobody" in plan.details() and answer.share_of_k() == 0
        with pytest.raises(InputError, match=r"test: expected .* without chains"):
            plan.test(driven, KEY, n=20)
        with pytest.raises(InputError, match=r"localise: expected .* chains"):
            plan.localise(driven, KEY, local)
        with pytest.raises(InputError, match=r"replay: expected .* chains"):
            replay(driven, plan.scene, plan.plan[None], KEY)
        assert plan.looks.taken == 0
