"""`learn` from logs: the eps that they support, and what it reports."""

import json

import jax
import numpy as np
import pytest
import toy_cart

import parc_jax as pj
from parc_jax.app.cli import logged

SMALL = (
    "--hidden",
    4,
    "--seeds",
    1,
    "--steps",
    40,
    "--bins",
    1,
    1,
    "--eps",
    0.2,
    "--delta",
    0.2,
    "--quiet",
    "--no-cache",
)


@pytest.fixture
def learn(shell, cart):
    return lambda *arguments: shell("learn", *arguments, *SMALL)


@pytest.mark.slow
def test_logged_runs_get_the_eps_they_support(learn, tmp_path):
    cart = toy_cart.Cart()
    data = pj.learning.collect(cart, jax.random.PRNGKey(1), n=50, quiet=True)
    np.savez(tmp_path / "log.npz", k=data.k, p=data.p + 3.0)
    times = ("--dt", 0.25, "--t-f", 1.0, "--dt-record", 0.05)
    code, said, _ = learn("log.npz", "--out", "model.npz", *times, "--holdout", 0.1)
    assert code == 0 and "was asked; 5 runs do not support it" in said
    assert pj.load(tmp_path / "model.npz").claim.eps > 0.2
    code, _, complained = learn("log.npz", "--out", "other.npz")
    assert code == 2 and "expected time=" in complained
    code, _, complained = learn("log.npz", "--out", "other.npz", "--dt", 0.25)
    assert code == 2 and "expected both" in complained
    assert not (tmp_path / "other.npz").exists()


@pytest.mark.slow
def test_a_tube_without_a_claim_is_json_that_others_can_read(learn, tmp_path):
    data = pj.learning.collect(toy_cart.Cart(), jax.random.PRNGKey(1), n=50, quiet=True)
    p = np.array(data.p)
    p[::3, -1] = np.nan
    np.savez(tmp_path / "log.npz", k=data.k, p=p)
    times = ("--dt", 0.25, "--t-f", 1.0, "--dt-record", 0.05)
    code, said, _ = learn("log.npz", "--out", "model.npz", *times, "--holdout", 0.5, "--json")
    told = json.loads(said, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert code == 1 and told["final_error"] == [None, None]


def test_few_runs_of_a_rigid_body_get_a_twist_unless_they_are_to_have_none(monkeypatch, tmp_path):
    monkeypatch.setattr(logged, "learn_report", lambda *given, **_: (given[3], given[2].hidden))
    rng, t = np.random.default_rng(0), np.linspace(0, 1, 5)
    k = rng.uniform(0.1, 1, (60, 2))
    tail, turn = np.stack([k[:, :1] * t, 0 * k[:, :1] * t], -1), k[:, 1:] * t
    nose = tail + np.stack([np.cos(turn), np.sin(turn)], -1)
    bent = nose + t[:, None] * rng.normal(size=(60, 1, 2))
    for points, asked, prior, hidden in (
        ([tail, nose], None, "twist", (24, 24)),
        ([tail, nose], "none", None, (8, 8, 8, 8)),
        ([tail, bent], None, None, (8, 8, 8, 8)),
        ([tail], None, None, (8, 8, 8, 8)),
    ):
        names = ("tail", "nose")[: len(points)]
        np.savez(tmp_path / "log.npz", k=k, p=np.stack(points, axis=2))
        log = logged.Logged(dt=0.25, t_f=1.0, prior=asked, points=names)
        found = logged.from_log(tmp_path / "log.npz", log, {}, 0)
        assert found == (prior, hidden), points


def test_what_a_log_measured_is_said_in_the_shell(monkeypatch, shell, tmp_path):
    seen = []
    monkeypatch.setattr(logged, "learn_report", lambda data, *_, **__: seen.append(data))
    k = np.random.default_rng(0).uniform(0.1, 1, (20, 2))
    np.savez(tmp_path / "log.npz", k=k, p=k[:, None] * np.linspace(0, 1, 5)[:, None])
    asked = ("learn", "log.npz", "--out", "model.npz", "--dt", 0.25, "--t-f", 1.0)
    shell(*asked, "--given", "k0")  # of which nothing is learned here
    assert [data.given for data in seen] == [(0,)]
    assert shell(*asked, "--given", "v")[0] == 2
