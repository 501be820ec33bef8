"""`learn` of logged runs: what cannot be meant is refused in one sentence, before any training."""

import warnings

import numpy as np
import pytest

import parc_jax as pj
from parc_jax.app import cli
from parc_jax.common.errors import InputError
from parc_jax.learning.runs.batch import rollout_batch
from parc_jax.learning.runs.law import law_spec
from parc_jax.learning.system import check_system

RNG = np.random.default_rng(0)
K = RNG.uniform(0.5, 1, (60, 2))
P = np.linspace(0, 1, 5)[None, :, None] * K[:, None]
LOGS = {
    "good": (K, P),
    "empty": (K[:0], P[:0]),
    "complex_k": (K + 1j, P),
    "complex_p": (K, P + 0j),
    "huge": (1e200 * K, P),
    "diverged": (K, 1e200 * P),
}
CASES = [
    ("empty", (), "empty.npz: expected at least one run; got 0 rows"),
    ("complex_k", (), "expected k as one array of real numbers. They are complex"),
    ("complex_p", (), "expected p as one array of real numbers. They are complex"),
    ("huge", (), "expected k with numbers up to 1e+100; the largest is 9.9"),
    ("diverged", (), "expected p with numbers up to 1e+100; the largest is 9.9"),
    ("good", ("--seed", -1), "seed: expected a whole number from 0 to 4294967295; got -1"),
    ("good", ("--seed", 99999999999999999999), "got 99999999999999999999"),
    ("good", ("--gap", "nan"), "gap: expected how much the start may matter"),
    ("good", ("--gap", -1), "gap: expected how much the start may matter"),
    ("good", ("--gap", "inf"), "gap: expected how much the start may matter"),
    ("good", ("--plant", "ode"), "--plant: expected with a system that can be run only"),
    ("good", ("--body", "disc"), "--body: expected with a system that can be run only"),
    ("good", ("--rollouts", 100), "--rollouts: expected with a system that can be run only"),
    ("good", ("--holdout", "nan"), "holdout: expected a share between 0 and 1"),
]


@pytest.fixture
def learn(shell, monkeypatch, tmp_path):
    """Learn a log. Nothing is trained."""

    def trained(*_, **__):
        raise AssertionError("a network was trained")

    monkeypatch.setattr("parc_jax.learning.learn.fit", trained)

    def run(name, *options):
        k, p = LOGS[name]
        np.savez(tmp_path / f"{name}.npz", k=k, p=p)
        times = ("--dt", 0.25, "--t-f", 1, "--out", "m.npz", "--no-cache", "--eps", 0.2)
        return shell("learn", f"{name}.npz", *times, *options)

    return run


@pytest.mark.parametrize(("name", "options", "why"), CASES)
def test_bad_logs_and_options_are_refused_in_one_sentence(learn, tmp_path, name, options, why):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        code, said, complained = learn(name, *options)
    assert code == 2 and said == "" and why in complained
    assert complained.startswith("parc-jax: ") and complained.count("\n") == 1
    assert [f.name for f in tmp_path.iterdir()] == [f"{name}.npz"]


@pytest.mark.parametrize("option", [("--dt", "0.1"), ("--k-law", "uniform"), ("--holdout", "0.2")])
def test_options_of_logs_are_refused_for_a_system(capsys, monkeypatch, tmp_path, option):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        cli.main(["learn", "asv", "--out", "m.npz", "--no-cache", *option])
    said, complained = capsys.readouterr()
    assert stop.value.code == 2 and said == "" and complained.count("\n") == 1
    assert f"{option[0]}: expected with logged runs only, which asv is not" in complained


def test_seeds_of_other_commands_are_looked_at_too(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        cli.main(["run", "asv", "--no-cache", "--seed", "-1"])
    assert stop.value.code == 2 and "seed: expected a whole number" in capsys.readouterr().err
    with pytest.raises(InputError, match="seed: expected a whole number"):
        batch().split(0.4, -1)


def batch(k=K):
    domain = pj.box([0, 0], [1, 1])
    law = law_spec("log", domain)
    return rollout_batch(
        k, P, np.zeros((60, 0)), time=pj.learning.time_grid(0.25, 1), domain=domain, law=law
    )


def test_a_system_with_numbers_that_overflow_is_refused():
    class Huge:
        name, n_p, n_q = "huge", 2, 0
        domain, time = pj.box([0, 0], [1e200, 1]), pj.learning.time_grid(0.25, 1)

        def rollout(self, key, k): ...

    with pytest.raises(InputError, match=r"huge: expected a domain with numbers up to 1e\+100"):
        check_system(Huge())


def test_bags_and_other_tables_are_told_their_way_in(shell, tmp_path):
    code, _, why = shell("learn", "drive.mcap", "--out", "m.npz", "--no-cache")
    assert code == 2 and "pj.exchange.load_bags" in why and not list(tmp_path.iterdir())
