"""`learn` from logs: the eps that they support, and what it reports."""

from pathlib import Path

import jax
import numpy as np
import pytest
import toy_cart

import parc_jax as pj
from parc_jax.app import cli

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
