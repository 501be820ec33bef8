"""What a long stage will cost is said before it is spent."""

import dataclasses
from pathlib import Path

import jax
import numpy as np
import pytest
from synthetic_plants import noisy, plant, straight_network
from toy_system import STUDY

import parc_jax as pj
from parc_jax.learning.bound.counts import required_runs
from parc_jax.learning.learn import forecast_of
from parc_jax.learning.runs.chunks import Forecast, Pace, spell

KEY, NET = jax.random.PRNGKey(0), straight_network(4)


def test_the_sentence():
    told = Forecast(12_300, "eps = 0.01 needs 690 runs").sentence("cart", 0.6)
    assert told == "cart: 12,300 runs x 0.6 s = 2 h; eps = 0.01 needs 690 runs"
    assert [spell(s) for s in (0.012, 0.6, 90, 7380, 1e6, 1e8)] == [
        "12 ms",
        "0.6 s",
        "1.5 min",
        "2 h",
        "12 d",
        "1,157 d",
    ]


def test_it_is_said_once_and_only_when_it_is_long(capsys):
    short, long, quiet = Forecast(29), Forecast(100), Forecast(100, quiet=True)
    for forecast in (short, long, long, quiet):
        forecast.measured("cart", 1.0)
    assert capsys.readouterr().err == "cart: 100 runs x 1 s = 1.7 min\n"


class Slow:
    """Not JAX: one row of work a run."""

    name, n_p, n_q, chunk = "slow", 2, 1, 4
    domain, time = plant(noisy).domain, plant(noisy).time

    def rollout_batch(self, keys, ks):
        s = np.linspace(0, 1, self.time.n_record + 1)[None, :, None]
        return pj.Trajectory(s * np.asarray(ks)[:, None], np.asarray(ks)[:, :1])


@pytest.mark.slow
def test_collect_and_bound_error_forecast_all_that_they_will_run(monkeypatch, capsys):
    monkeypatch.setattr(Pace, "of", lambda *_: 4.0)
    pj.learning.collect(Slow(), KEY, 12)
    assert "slow: 12 runs x 4 s = 48 s" in capsys.readouterr().err
    pj.learning.bound_error(NET, Slow(), KEY, eps=0.05, delta=0.5, bins=(1, 1), profile_runs=10)
    told = capsys.readouterr().err
    # 10 for the profile, 14 for the holdout
    assert told.count(" runs x ") == 1 and "slow: 24 runs x 4 s" in told
    assert "eps = 0.5 needs 2 fresh ones" in told
    pj.learning.bound_error(
        NET, Slow(), KEY, eps=0.05, delta=0.5, bins=(1, 1), profile_runs=10, quiet=True
    )
    assert capsys.readouterr().err == ""


def test_the_shell_forecasts_a_whole_study():
    told = forecast_of(STUDY)
    assert told.runs > 60 + 100 and told.advice == ""  # claims by bin
    early = forecast_of(STUDY, early=True)
    assert early.runs - told.runs == required_runs(max(STUDY.eps, 0.01), STUDY.delta)
    one = forecast_of(dataclasses.replace(STUDY, blocks=None, eps=0.01))
    assert (one.runs, one.advice) == (60 + 100 + 299, "--eps 0.1 needs 29 fresh ones")


def test_the_readme_counts_every_run_of_the_main_job():
    import toy_system

    from parc_jax.app.study.job import LOOKS
    from parc_jax.drive.local.localise import Local
    from parc_jax.drive.local.validate import Validate
    from sims.drift_parking.study import STUDY as MAIN

    told = (Path(pj.__file__).parents[1] / "README.md").read_text()
    local, each = Local(eps=MAIN.eps), MAIN.delta / LOOKS
    assert MAIN.driven and MAIN.repeats == 1
    chosen = required_runs(MAIN.eps, each)
    near = local.rollouts + local.profile_runs + required_runs(local.eps, each)
    tests = Validate(toy_system.system(), MAIN.risk, MAIN.delta).tests
    runs = forecast_of(MAIN, early=True).runs + MAIN.samples + tests + chosen + near
    assert f"{runs:,} runs of the car" in told
