"""Training a network on for the widths of a fitted tube."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from synthetic_plants import plant, straight, straight_network

from parc_jax.arrays import x64
from parc_jax.claim import tighten
from parc_jax.claim.fitting import fitted_profile
from parc_jax.claim.tighten import fit_to_tube
from parc_jax.errors import InputError
from parc_jax.experiment.learn import networks
from parc_jax.experiment.settings import Study, checked
from parc_jax.network.predict import layout_of
from parc_jax.network.relu import relu_network
from parc_jax.rollout.collect import collect

KEY, NET = jax.random.PRNGKey(0), straight_network(4)
pytestmark = pytest.mark.soundness


@pytest.fixture(autouse=True)
def few_steps(monkeypatch):
    monkeypatch.setattr(tighten, "STEPS", 100)
    monkeypatch.setattr(tighten, "PEAK", 1e-2)


def off_centre(key, k, s):
    """One-sided errors with few large ones: the mean is far from the middle."""
    p, q = straight(k, s)
    late = jax.random.uniform(key, (2,)) ** 4
    return p + s[:, None] * (0.1 * late * jnp.array([1.0, 0.5]))[None], q + 0.1 * late[0]


@pytest.fixture(scope="module")
def train():
    return collect(plant(off_centre), KEY, 300, quiet=True)


def steeper(net, factor):
    return relu_network([net.weights[0] * factor], list(net.biases))


def higher(net, by):
    return relu_network(list(net.weights), [net.biases[0] + by])


def cost(net, train, bins):
    layout = layout_of(train)
    runs = tighten._by_bin(train, layout, bins)
    layers = list(zip(net.weights, net.biases, strict=True))
    with x64():
        along = tighten._directions(layers, runs, layout)
        return float(tighten._whole_cost(layers, runs, along, layout=layout))


@pytest.mark.slow
def test_a_wrong_slope_is_taken_out_and_the_tube_becomes_narrow(train):
    wrong = steeper(NET, 1.2)
    right = fit_to_tube(wrong, train, (2, 1), key=KEY)
    wide, narrow, best = (
        fitted_profile(net, [train], (2, 1)).templates.interval.half for net in (wrong, right, NET)
    )
    assert (narrow[:, 1:] < 0.8 * wide[:, 1:]).mean() > 0.9
    assert narrow.mean() < 1.1 * best.mean() < 0.7 * wide.mean()


def test_constants_belong_to_the_centres_and_cost_nothing(train):
    np.testing.assert_allclose(cost(higher(NET, 0.3), train, (2, 1)), cost(NET, train, (2, 1)))


def test_the_cost_is_the_mean_logarithm_of_half_widths(train):
    """By plain loops, over bins of different numbers of runs."""
    edges, total = [0.0, 0.3, 1.0], []
    layout, stride = layout_of(train), train.time.stride
    expected = np.concatenate([np.arange(1, 5)[:, None, None] / 4 * train.k[None]])
    error = train.p[:, stride::stride] - expected.swapaxes(0, 1)
    end = np.concatenate([error[:, -1], train.q - train.k[:, :1]], axis=1)[:, None]
    for lo, hi in itertools.pairwise(edges):
        inside = (train.k[:, 0] >= lo) & (train.k[:, 0] < hi)
        of_bin = 0.0
        for one, share in ((error[inside], 1.0), (end[inside], tighten.AT_END)):
            seen = one - one.mean(axis=0)
            u = tighten.with_principal_axes(np.einsum("msa,msb->sab", seen, seen) / len(seen))
            off = np.einsum("srn,msn->msr", u, one)
            off = np.abs(off - 0.5 * (off.min(axis=0) + off.max(axis=0)))
            half = (off**tighten.POWER).mean(axis=0) ** (1 / tighten.POWER)
            width = half[:, : u.shape[-1]]
            if share == 1.0:
                width = np.broadcast_to(width.mean(axis=0), width.shape)
            more = np.einsum("srn,sn->sr", np.abs(u), 0.1 * width + 1e-3)
            of_bin += share * np.log(half + more).mean()
        total.append(of_bin)
    assert layout.n_points == 1
    found = cost(NET, train, (edges, 1))
    np.testing.assert_allclose(found, np.mean(total), rtol=1e-9)


@pytest.mark.night
def test_what_cannot_be_improved_is_kept():
    exact = collect(plant(lambda key, k, s: straight(k, s)), KEY, 60, quiet=True)
    assert fit_to_tube(NET, exact, (2, 1), key=KEY).hash == NET.hash


@pytest.mark.slow
def test_a_network_that_became_worse_is_dropped(train, monkeypatch):
    monkeypatch.setattr(tighten, "PEAK", 30.0)  # more bins than elsewhere: compiled with this step
    assert fit_to_tube(NET, train, (3, 1), key=KEY).hash == NET.hash


@pytest.mark.night
def test_a_study_asks_for_it(train):
    study = Study(
        hidden=(3,), others=(), bins=(2, 1), shape="fitted", seeds=1, steps=50, tail="tube"
    )
    plain = Study(hidden=(3,), others=(), bins=(2, 1), shape="fitted", seeds=1, steps=50)
    ours, theirs = (networks(train, asked, KEY)[0] for asked in (study, plain))
    assert ours.hash != theirs.hash
    assert cost(ours, train, (2, 1)) < cost(theirs, train, (2, 1))


@pytest.mark.parametrize("given", [{"tail": "tube"}, {"tail": "tip", "shape": "fitted"}])
def test_a_study_that_cannot_have_it_is_refused(given):
    with pytest.raises(InputError, match='"tube" for tubes of shape "fitted"'):
        checked(Study(**given))
