"""Counting replays by the million: what was counted is kept, and only the same work goes on."""

import json

import numpy as np
import pytest

from benchmarks import replays


class Told:
    """In place of an answer, its model and its system: each plan says which one it is."""

    model, scene = None, None

    def sample(self, key, n):
        """n plans that are told apart by their key."""
        return np.full((n, 1), int(np.asarray(key)[-1]))


@pytest.fixture
def counted(monkeypatch, tmp_path):
    """The command over an answer that takes no simulator, and the steps that it made."""
    steps = []

    def counts_of(system, scene, plans, key):
        steps.append((len(plans), int(plans[0, 0])))
        return {"plans": len(plans), "reached": len(plans) - 1, "touched": 0, "left the tube": 1}

    monkeypatch.setattr(replays, "load_answer", lambda path: Told())
    monkeypatch.setattr(replays, "counts_of", counts_of)
    monkeypatch.setattr(replays, "keep_compiled", lambda: None)
    asked = tmp_path / "answer.json"
    asked.write_text("{}")

    def run(n, **options):
        return replays.main(
            replays.Options(answer=asked, n=n, json=tmp_path / "counts.json", **options)
        )

    return run, steps, tmp_path


def test_an_interrupted_count_goes_on_with_the_plans_that_are_missing(counted):
    run, steps, _ = counted
    whole = run(2 * replays.STEP + 5)
    (counted_file := counted[2] / "counts.json").unlink()
    first = steps.copy()
    steps.clear()
    run(2 * replays.STEP)
    assert json.loads(counted_file.read_text())["plans"] == 2 * replays.STEP
    again = run(2 * replays.STEP + 5)
    assert steps == first and [n for n, _ in steps] == [replays.STEP, replays.STEP, 5]
    assert again["reached"] == whole["reached"] == 2 * replays.STEP + 2
    assert again["left the tube"] == 3
    run(2 * replays.STEP + 5)
    assert len(steps) == 3  # all is counted
