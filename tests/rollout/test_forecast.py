"""README says how many runs of the car its first command makes."""

from pathlib import Path

import parc_jax as pj
from parc_jax.learning.bound.counts import required_runs
from parc_jax.learning.bound.pipeline import runs_ahead
from parc_jax.learning.learn import _first_bound


def test_the_readme_counts_every_run_of_the_main_job():
    import toy_system

    from parc_jax.app.study.job import LOOKS
    from parc_jax.drive.local.localise import Local
    from parc_jax.drive.local.validation import Validate
    from sims.drift_parking.study import STUDY as MAIN

    told = (Path(pj.__file__).parents[1] / "README.md").read_text()
    local, each = Local(eps=MAIN.bound.eps), MAIN.bound.delta / LOOKS
    assert MAIN.driven and MAIN.repeats == 1
    chosen = required_runs(MAIN.bound.eps, each)
    near = local.rollouts + local.profile_runs + required_runs(local.eps, each)
    tests = Validate(toy_system.system(), MAIN.risk, MAIN.bound.delta).tests
    bounds = MAIN.claims, _first_bound(MAIN)
    of_claims = sum(map(runs_ahead, bounds))
    runs = MAIN.rollouts + of_claims + MAIN.settings.samples + tests + chosen + near
    assert f"{runs:,} runs of the car" in told
