"""A study asks a first model, with a claim of few runs, before it makes the many."""

import gc
import weakref
from types import SimpleNamespace

import jax
import pytest
import toy_driven as toy
from synthetic_plants import noisy, plant
from tqdm import tqdm

import parc_jax as pj
from parc_jax.app.study import job
from parc_jax.app.study.settings import Study
from parc_jax.learning.bound import pipeline
from parc_jax.learning.bound.pipeline import runs_ahead
from parc_jax.learning.bound.settings import ModelBound
from parc_jax.learning.learn import learn_report
from parc_jax.planner import Planner

KEY = jax.random.PRNGKey(5)
STUDY = Study(hidden=(), rollouts=200, bound=ModelBound(eps=0.1, delta=0.05, profile_runs=300))


def learned(tmp_path, monkeypatch, first=None, study=STUDY):
    """The models, first one included, and the ids of the fresh runs behind each claim in turn."""
    fresh = []

    def seen(*given):
        scores = scores_of(*given)
        fresh.append(set(scores.ids))
        return scores

    scores_of = pipeline.scores_of
    monkeypatch.setattr(pipeline, "scores_of", seen)
    firsts = []
    ask = firsts.append if first is None else first
    made = learn_report(plant(noisy, toy.T), KEY, study, path=tmp_path, quiet=True, first=ask)
    return made, firsts, fresh


def test_the_first_claim_takes_nothing_from_the_one_to_come(monkeypatch, tmp_path):
    made, (first,), fresh = learned(tmp_path / "with", monkeypatch)
    assert len(fresh) == 2 and not fresh[0] & fresh[1]
    assert not fresh[0] & set(made.train.hashes())
    alone = pj.learn(plant(noisy, toy.T), KEY, settings=STUDY, quiet=True)
    assert made.model.claim.to_json() == alone.claim.to_json()
    assert made.model.tube.hash == alone.tube.hash
    assert first.net.hash == alone.net.hash and first.tube.hash != alone.tube.hash


@pytest.mark.parametrize("eps, kept", [(0.001, 0.01), (0.1, 0.1)])
def test_the_first_claim_is_of_few_runs(eps, kept, monkeypatch, tmp_path):
    class Enough(Exception):
        pass

    def stop(model):
        assert float(model.claim.eps) == kept and float(model.claim.delta) == STUDY.bound.delta
        raise Enough

    study = STUDY.replace(eps=eps, blocks=(1, 1))
    with pytest.raises(Enough):
        learned(tmp_path, monkeypatch, stop, study)
    assert not (tmp_path / "fresh").exists() and (tmp_path / "first" / "fresh").exists()


def test_training_runs_are_let_go_before_the_search(tmp_path, monkeypatch):
    class Enough(Exception):
        pass

    class Asked(Planner):
        def warm_up(self, *_, **__):
            return SimpleNamespace(samples=())

        def solve(self, *_, **__):
            gc.collect()
            assert trained() is None
            raise Enough

    def learned(*arguments, **options):
        nonlocal trained
        made = learn_report(*arguments, **options)
        trained = weakref.ref(made.train)
        return made

    trained = None
    monkeypatch.setattr(job, "learn_report", learned)
    monkeypatch.setattr(job, "Planner", Asked)
    system = plant(noisy, toy.T)
    with pytest.raises(Enough):
        job.run_study(system, toy.problem(), STUDY, tmp_path, seed=0, quiet=True, figures=True)


def test_the_time_ahead_is_told_from_the_pace_of_the_first_runs(monkeypatch, capsys):
    """A clock on which each chunk takes 3 s, and the first, which is compiled for, 60 s."""
    hours = iter([0.0, 60.0, 60.0, *(60.0 + 3.0 * i for i in range(1, 100))])
    clock = SimpleNamespace(monotonic=lambda: next(hours))
    monkeypatch.setattr("parc_jax.learning.learn.time", clock)
    system = plant(noisy, toy.T)
    object.__setattr__(system, "chunk", 50)
    monkeypatch.setattr("parc_jax.learning.learn.fit_network", lambda *_: 1 / 0)  # enough is seen
    with pytest.raises(ZeroDivisionError):
        pj.learn(system, KEY, settings=STUDY)
    said = [line for line in capsys.readouterr().err.splitlines() if "at this pace" in line]
    ahead = 100 + runs_ahead(STUDY.claims)  # two chunks of 200 runs are made
    assert (
        len(said) == 1 and f"{ahead:,} more runs, {tqdm.format_interval(ahead * 3 / 50)}" in said[0]
    )
