"""Runs of real logs that no one has seen are counted as runs, of so many recordings."""

from fractions import Fraction
from types import SimpleNamespace

import numpy as np

from benchmarks import few_runs
from parc_jax.common.sets.box import box
from parc_jax.learning.bound.counts import RECORDINGS
from parc_jax.learning.runs.batch import rollout_batch
from parc_jax.learning.runs.law import law_spec
from parc_jax.learning.system import time_grid


def runs_of(recordings):
    """Recordings of two windows each."""
    n, time = 2 * recordings, time_grid(0.5, 1.0)
    domain = box([0.0], [n - 1.0])
    return rollout_batch(
        np.arange(float(n))[:, None],
        np.zeros((n, time.n_record + 1, 2)),
        np.zeros((n, 0)),
        time=time,
        domain=domain,
        law=law_spec("file:log", domain, "logged"),
        groups=np.arange(n) // 2,
    )


def test_the_share_of_k_is_told_as_a_lower_bound_with_its_confidence(monkeypatch):
    claim = SimpleNamespace(discard=0, n=4, unit=RECORDINGS, eps=0.9)
    model = SimpleNamespace(tube=SimpleNamespace(interval=np.ones(1)), claim=claim)
    model.domain = box([0.0], [19.0])
    status = SimpleNamespace(found=True, label="found")
    answer = SimpleNamespace(status=status, share_of_k=lambda: 0.5199, validation=None)
    learned = SimpleNamespace(model=model, prior="none")
    monkeypatch.setattr(few_runs, "learn_report", lambda *_, **__: learned)
    monkeypatch.setattr(few_runs, "replay_recorded", lambda *_: None)
    solved = SimpleNamespace(solve=lambda *_: answer)
    monkeypatch.setattr(few_runs.pj, "Planner", lambda model: solved)
    case = few_runs.Case("toy", lambda folder: runs_of(10), (1.0, 1.0), (2.0, 2.0))
    said = few_runs.row(case, None, 0, None, None, False)
    assert "found, at least 51 % of K (99.9 % confidence) | 0 runs" in said


def test_unseen_runs_are_told_as_runs_of_recordings_and_those_outside_k_are_counted(monkeypatch):
    """A window has its k outside of the set's K."""
    unseen, wide = runs_of(3), box([0.0], [5.0])
    claim = SimpleNamespace(discard=1, n=30, unit=RECORDINGS, evidence={"scale": "0.9"})
    tested = SimpleNamespace(
        model=SimpleNamespace(domain=box([0.0], [4.5]), claim=claim),
        starts=lambda key, k, most: [np.zeros((most * (x < 3), 2)) for x in k[:, 0]],
        share=SimpleNamespace(share=Fraction(1, 2)),
        scene=None,
    )
    step = SimpleNamespace(failed=4, n=33)
    answer = SimpleNamespace(validation=SimpleNamespace(answer=tested, steps=[step]))
    monkeypatch.setattr(
        few_runs, "_went", lambda scene, runs, p0: (p0[:, 0] == 0, runs.k[:, 0] > 0)
    )
    said = few_runs.validated(answer, unseen, 0)
    assert "1 of 30 recordings failed at 0.9, next 4 of 33" in said
    assert "3 runs of 2 recordings with a start, of 6 runs of 3 recordings" in said
    assert "1 of these runs outside K, 10 of 30 replays failed" in said
    assert few_runs._started(unseen, np.zeros(0, int), wide).startswith("0 runs of 0 recordings")
