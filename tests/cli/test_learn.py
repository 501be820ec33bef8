"""`learn` from a system and from logs: what it reports, what it refuses, and how it goes on after
Ctrl-C.
"""

import json
from pathlib import Path

import jax
import numpy as np
import pytest
import toy_cart

import parc_jax as pj
from parc_jax.app import cli
from parc_jax.learning.runs import collect as collecting

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
def learn(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(Path(toy_cart.__file__).parent))

    def run(*arguments):
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            cli.main(["learn", *(str(a) for a in arguments), *(str(a) for a in SMALL)])
        return stop.value.code, *capsys.readouterr()

    return run


@pytest.mark.night
def test_a_fitted_tube_is_asked_for_by_its_name(learn, tmp_path):
    code, _, _ = learn("toy_cart", "--out", "m.npz", "--rollouts", 100, "--shape", "fitted")
    assert code == 0 and pj.load(tmp_path / "m.npz").tube.templates is not None
    code, _, err = learn("toy_cart", "--out", "n.npz", "--rollouts", 100, "--shape", "round")
    assert code == 2 and "shape: expected one of box, fitted" in err


@pytest.mark.slow
def test_a_stopped_run_continues_to_the_same_model(learn, monkeypatch, tmp_path):
    real, calls = collecting.simulate_rows, []

    def stopping(*arguments, **options):
        calls.append(1)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return real(*arguments, **options)

    arguments = ("toy_cart", "--out", "model.npz", "--rollouts", 600)
    monkeypatch.setattr(collecting, "simulate_rows", stopping)
    code, _, complained = learn(*arguments)
    assert code == 130 and "the same command continues" in complained
    assert not (tmp_path / "model.npz").exists() and (tmp_path / "model.npz.unfinished").is_dir()
    monkeypatch.setattr(collecting, "simulate_rows", real)
    code, said, complained = learn(*arguments)
    assert (
        code == 0
        and "mattered by at most 0" in said
        and "With confidence 0.8" in said
        and not complained
    )
    assert [f.name for f in tmp_path.iterdir()] == ["model.npz"]
    first = pj.load(tmp_path / "model.npz", system="cart")
    code, said, _ = learn("toy_cart", "--out", "again.npz", "--rollouts", 600, "--json")
    assert code == 0 and json.loads(said)["rollouts"] == 600
    assert pj.load(tmp_path / "again.npz").net.hash == first.net.hash


@pytest.mark.slow
def test_a_system_that_depends_on_its_start_is_refused_with_the_size(learn, tmp_path):
    code, said, complained = learn(
        "toy_cart", "--plant", "hill", "--out", "model.npz", "--rollouts", 50
    )
    assert (
        code == 2
        and said == ""
        and "depend on where they start" in complained
        and "m and the final" in complained
    )
    assert not list(tmp_path.iterdir())


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
def test_commands_drawn_uniformly_can_be_said_to_be(learn, tmp_path):
    cart = toy_cart.Cart()
    data = pj.learning.collect(cart, jax.random.PRNGKey(1), n=200, quiet=True)
    np.savez(tmp_path / "log.npz", k=data.k, p=data.p)
    corners = np.stack([cart.domain.lo, cart.domain.hi], axis=1).ravel()
    times = ("--dt", 0.25, "--t-f", 1.0, "--dt-record", 0.05)
    drawn = ("--domain", *corners, "--k-law", "uniform", "--discard", 0)
    code, said, _ = learn("log.npz", "--out", "uniform.npz", *times, *drawn)
    assert code == 0 and "share s of K: at most" in said
    claim = pj.load(tmp_path / "uniform.npz").claim
    assert claim.law.k_law == "uniform" and claim.discard == 0
    assert claim.eps < 0.05  # 80 runs at delta = 0.2, though 0.2 was asked
    code, said, _ = learn("log.npz", "--out", "logged.npz", *times)
    assert code == 0 and "as in the log" in said and "share s of K" not in said
    assert pj.load(tmp_path / "logged.npz").claim.discard > 0
    for wrong in (("--k-law", "uniform"), ("--domain", 0.5, 1.0, -0.5), ("--k-law", "even")):
        code, _, complained = learn("log.npz", "--out", "no.npz", *times, *wrong)
        assert code == 2 and "expected" in complained and complained.count("\n") == 1
