"""Runs to train on: of a twist or a simulator, corrected by the real ones."""

import jax
import numpy as np
import pytest
import slipping

from parc_jax.common.errors import InputError
from parc_jax.common.keys import Stage
from parc_jax.common.sets.box import box
from parc_jax.learning.bound.fresh import ledger_of
from parc_jax.learning.learn import learn
from parc_jax.learning.prior import teach
from parc_jax.learning.prior.identify import flat
from parc_jax.learning.prior.teach import TWIST, taught
from parc_jax.learning.runs.collect import collect
from parc_jax.learning.system import Trajectory, time_grid

KEY = jax.random.PRNGKey(0)
TRAIN = slipping.drawn(60)


def as_made(k):
    """Twist (n, 3), without slip but for some of the turning."""
    return np.column_stack([k[:, 0], 0 * k[:, 1], 0.7 * k[:, 1]])


class Simulator:
    """The robot as its maker thinks that it drives, over more than K: in NumPy."""

    name, n_p, n_q, points = "maker", 2, 1, slipping.NAMES
    domain, time = box([-1.0, -1.0], [1.0, 1.0]), slipping.TIME
    broken = 2.0  # [m/s] from which on it fails

    def rollout_batch(self, keys, ks):
        k = np.clip(np.asarray(ks), slipping.K.lo, slipping.K.hi)
        done = slipping.recorded(k, as_made(k))
        p = done.p.reshape(len(k), -1, len(slipping.CORNERS), 2).copy()
        p[k[:, 0] > self.broken] = np.nan
        return Trajectory(p, done.q)


@pytest.mark.slow
def test_a_twist_gives_as_many_runs_as_one_likes_near_the_robot():
    runs = slipping.recorded(TRAIN, noise=0.01)
    found = taught(TWIST, runs, 500, KEY)
    truth = flat(slipping.recorded(found.runs.k))
    assert found.runs.n == 500 and np.abs(flat(found.runs) - truth).max() < 0.03
    assert found.said.startswith("prior twist, order 1 in k and 0 in time; ")
    assert (found.runs.k.min(axis=0) < [-0.38, -0.77]).all() and found.runs.groups is None
    again = taught(TWIST, runs, 500, KEY)
    np.testing.assert_array_equal(flat(again.runs), flat(found.runs))


@pytest.mark.slow
def test_a_simulator_that_is_wrong_is_put_right_by_the_real_runs():
    runs = slipping.recorded(TRAIN, noise=0.002)
    found = taught(Simulator(), runs, 300, KEY)
    assert found.said.startswith("prior maker; corrected by residuals")
    truth = flat(slipping.recorded(found.runs.k))
    own = flat(slipping.recorded(found.runs.k, as_made(found.runs.k)))
    better = np.abs(flat(found.runs) - truth).max(axis=1)
    assert np.median(better) < 0.2 * np.median(np.abs(own - truth).max(axis=1))


class Noting(Simulator):
    """It keeps the keys that it was run with."""

    def __init__(self):
        self._keys = set()

    def rollout_batch(self, keys, ks):
        self._keys |= {bytes(np.asarray(jax.random.key_data(key))) for key in keys}
        return super().rollout_batch(keys, ks)


def test_a_simulator_has_disturbances_of_its_own():
    """Of one key, too, none of them are those of runs that may be held out."""
    runs, prior = slipping.recorded(TRAIN, noise=0.002), Noting()
    small = {"rollouts": 64, "hidden": (4,), "seeds": 1, "steps": 10, "eps": 0.3, "delta": 0.1}
    model = learn(runs, KEY, prior, quiet=True, **small)
    own, robot = prior._keys.copy(), Noting()
    for stage in (Stage.TRAIN, Stage.BOUND):
        collect(robot, KEY, 512, stage, quiet=True)
    assert own and not own & robot._keys
    seen = {entry[0]: entry[1:] for entry in ledger_of(model.claim)}
    assert seen["prior"] == ["maker", [0, 0], int(Stage.PRIOR), [[0, 8 * 30 - 1]], []]
    assert len(seen["training"][3]) == len(seen["calibration"][3]) == 30 and not seen["profile"][3]


class Rough(Simulator):
    """It says of every k something else."""

    def rollout_batch(self, keys, ks):
        p, q = super().rollout_batch(keys, ks)
        off = np.sin(900 * np.asarray(ks)).sum(axis=1)[:, None, None, None]
        return Trajectory(p + off * np.linspace(0, 1, p.shape[1])[:, None, None], q)


def test_a_prior_that_runs_alone_surpass_is_left_out():
    runs = slipping.recorded(TRAIN, noise=0.002)
    found = taught(Rough(), runs, 300, KEY)
    assert found.said.startswith("prior maker, left out: the runs alone; ")
    truth = flat(slipping.recorded(found.runs.k))
    assert np.median(np.abs(flat(found.runs) - truth).max(axis=1)) < 0.05
    assert "left out: the" not in taught(Simulator(), runs, 300, KEY).said


def spinning(k, noise=0.0):
    """Runs of a robot that goes straight and turns ever faster, up to eight radians: few runs do
    not show a twist.
    """
    runs, s = slipping.recorded(k, noise=noise), np.linspace(0, 1, slipping.TIME.n_record + 1)
    heading = 8 * k[:, 1:] * s**3
    ahead = np.exp(1j * heading)[..., None] * (slipping.CORNERS @ np.array([1.0, 1j]))
    at = (2 * k[:, :1] * s)[..., None] + ahead
    offset = runs.p - slipping.recorded(k).p
    p = np.stack([at.real, at.imag], axis=-1).reshape(runs.p.shape) + offset
    return runs.replace(p=p, q=heading[:, -1:])


@pytest.mark.slow
@pytest.mark.parametrize(("n", "alone"), [(16, True), (60, False)])
def test_a_twist_is_taken_where_fresh_runs_would_take_it(n, alone, monkeypatch):
    """The choice is by cross-fitting: no fresh run is asked."""
    runs = spinning(slipping.drawn(n), noise=0.01)
    found = taught(TWIST, runs, 300, KEY)
    sizes = iter((1, 0) if alone else (0, 1))
    monkeypatch.setattr(teach, "log_sizes", lambda *_: np.array(next(sizes)))
    other = taught(TWIST, runs, 300, KEY)
    truth = flat(spinning(found.runs.k))
    near, far = (np.median(np.abs(flat(one.runs) - truth).max(axis=1)) for one in (found, other))
    assert ("left out: the runs alone" in found.said) == alone and near < 0.9 * far


def test_sizes_are_of_all_training_runs_and_failed_ones_have_none():
    runs = slipping.recorded(TRAIN)
    p = runs.p.copy()
    p[4, 3] = np.inf
    runs = runs.replace(p=p)
    found = taught(TWIST, runs, 50, KEY)
    assert np.isinf(found.size).nonzero()[0].tolist() == [4] and found.unseen.n == 59
    picky = Simulator()
    picky.broken = 0.5
    found = taught(picky, runs, 50, KEY)
    fails = runs.failed | (TRAIN[:, 0] > 0.5)
    assert (np.isinf(found.size) == fails).all() and found.unseen.n == (~fails).sum()


def test_a_simulator_of_something_else_is_refused():
    runs, named = slipping.recorded(TRAIN), ("speed [m/s]", "turn [rad/s]")
    runs = runs.replace(labels=runs.subject.with_labels({"k": named}).labels)
    for change, why in (
        ({"k_labels": named[::-1]}, "agree; parameters is speed .*, beside turn"),
        ({"given": (0,)}, "agree; given is none, beside 0. Of a log, say what was measured: given"),
        ({"time": time_grid(0.5, 2.0, 0.125)}, "agree; time is"),
        ({"points": ("reference",)}, "agree; points is"),
        ({"n_q": 0}, "goal states: 1, parameters: 2, beside"),
        ({"domain": box([0.0, 0.0], [1.0, 1.0])}, "a domain that holds that of the recorded"),
        ({"domain": box([-1.0], [1.0])}, "parameters: 2, beside"),
        ({"broken": -9.0}, "runs that are finite, and that maker can do too; got 0 of 60"),
    ):
        other = Simulator()
        vars(other).update(change)
        with pytest.raises(InputError, match=why):
            taught(other, runs, 50, KEY)
    other = Simulator()
    other.given = (0,)
    teach.require_like(other, runs.replace(given=(0,)))
    teach.require_like(Simulator(), runs.replace(given=(0,)))  # it may draw what was measured


def test_too_little_to_learn_from_is_refused():
    runs = slipping.recorded(TRAIN)
    with pytest.raises(InputError, match="at least 10 training runs that are finite; got 5 of 5"):
        taught(TWIST, runs.select(slice(0, 5)), 50, KEY)
    with pytest.raises(InputError, match="expected \"twist\" or a system; got 'tvist'"):
        taught("tvist", runs, 50, KEY)
    flat_k = runs.replace(domain=box([-0.4, 0.1], [0.6, 0.1]))
    with pytest.raises(InputError, match="every parameter to vary; axis 1 is constant"):
        taught(TWIST, flat_k, 50, KEY)
