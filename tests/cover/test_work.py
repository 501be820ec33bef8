"""Work ends a search, and no clock: the same key gives the same bits however slow or busy the
machine. A limit in seconds lies above the work; what it cuts off, the answer says.
"""

import itertools
import subprocess
import sys
from dataclasses import replace

import jax
import numpy as np
import pytest
from toy_models import toy_case

import parc_jax as pj
from parc_jax import method as methods
from parc_jax.answer.answer import answer_data
from parc_jax.app.files.answer_file import load_answer
from parc_jax.common.status import Ended
from parc_jax.problem.robust.nominal import NominalProblem
from parc_jax.safe_set.corridors import rare, search
from parc_jax.safe_set.corridors.first import MOST
from parc_jax.safe_set.corridors.sampling import RARE_DRAW, Draw, no_points
from parc_jax.safe_set.corridors.search import cover
from parc_jax.safe_set.corridors.stopping import Limit
from parc_jax.safe_set.settings import CORRIDORS, LEAVES, LOOKS, work_of
from parc_jax.safe_set.verdict.scene import pruned_scene

KEY = jax.random.PRNGKey(3)
MODEL, PROBLEM = toy_case(4)
WHOLE = pj.Settings(samples=5, target=0.003)
LITTLE = WHOLE.replace(target=1e-4, work=3 / LOOKS)  # three looks, which are not enough


def ask(settings: pj.Settings) -> pj.types.Answer:
    return pj.Planner(MODEL).solve(PROBLEM, KEY, settings)


def slowly(monkeypatch, step: float) -> None:
    """A machine on which so many seconds pass from one look at the clock to the next."""
    clock = itertools.count(0.0, step)
    monkeypatch.setattr("time.perf_counter", lambda: next(clock))


@pytest.mark.parametrize(
    ("settings", "ended"), [(WHOLE, Ended.TARGET), (LITTLE, Ended.WORK)], ids=["target", "work"]
)
def test_a_slow_machine_gives_the_same_bits(monkeypatch, settings, ended):
    quick = ask(settings)
    slowly(monkeypatch, 3.0)
    slow = ask(settings)
    assert answer_data(slow) == answer_data(quick) and slow.cover.ended is ended
    assert f"ended by its {ended}, " in slow.details()


def test_a_busy_machine_gives_the_same_bits():
    alone = ask(LITTLE)
    burn = [sys.executable, "-c", "while True: pass"]
    load = [subprocess.Popen(burn) for _ in range(4)]
    try:
        beside = ask(LITTLE)
    finally:
        for process in load:
            process.kill()
            process.wait()
    assert answer_data(beside) == answer_data(alone)


def test_what_seconds_cut_off_is_said_and_kept(monkeypatch, tmp_path):
    whole = ask(WHOLE)
    slowly(monkeypatch, 1e4)
    answer = ask(WHOLE)
    assert answer.status.found and answer.cover.ended is Ended.SECONDS
    assert len(answer.cover.history) < len(whole.cover.history)
    assert "ended by its seconds, a limit that cut work off" in answer.details()
    again = load_answer(answer.save(tmp_path / "answer.json"))
    assert again.cover.ended is Ended.SECONDS and again.details().startswith(answer.details())


class After(Limit):
    """A limit that cuts off at one of the questions to it."""

    def __init__(self, questions: int):
        super().__init__(600.0)
        self.left = questions

    def over(self, reserved: float = 0.0) -> bool:
        self.left -= 1
        self.cut = self.cut or self.left == 0
        return self.cut


def test_a_target_that_is_reached_after_a_cut_is_not_told_as_reached():
    """Enough is covered by what was built before; the seconds decided which corridors that are."""
    asked = {"target": 0.1, "confidence": 0.99, "work": work_of(1.0)}
    scene = pruned_scene(NominalProblem(PROBLEM, MODEL))
    reached = []
    for questions in range(1, 12):
        limit = After(questions)
        found = cover(scene, np.random.default_rng(0), limit=limit, **asked)
        assert found.ended is (Ended.SECONDS if limit.cut else Ended.TARGET)
        reached.append(limit.cut and found.coverage.at_least >= 0.9)
    assert any(reached)


def test_a_slow_machine_lets_as_many_plans_climb(monkeypatch):
    sizes: list[int] = []
    monkeypatch.setattr(rare, "_raise_to_safe", lambda scene, rng, n, _: sizes.append(n))
    slowly(monkeypatch, 30.0)
    limit = Limit(600.0)
    limit.start()
    rng = np.random.default_rng(0)
    asked = pruned_scene(NominalProblem(PROBLEM, MODEL)), rng
    assert rare.where_safe(*asked, work_of(1.0).population, limit) is None and not limit.cut
    assert sizes == [512, 1024, 2048, 4096, 8192]
    assert rare.where_safe(*asked, work_of(1.0).population, After(2)) is None
    assert sizes[5:] == [512, 1024]


def test_seconds_end_a_climb_between_its_levels(monkeypatch):
    levels = []
    monkeypatch.setattr(rare, "_margins", lambda scene, x: -np.ones(len(x)))
    monkeypatch.setattr(rare, "_moved", lambda scene, rng, plans, *_: levels.append(1) or plans)
    scene, limit = pruned_scene(NominalProblem(PROBLEM, MODEL)), After(2)
    assert rare.where_safe(scene, np.random.default_rng(0), 8192, limit) is None
    assert limit.cut and len(levels) == 2


def test_seconds_end_a_climb_between_its_moves(monkeypatch):
    looks = []
    monkeypatch.setattr(rare, "_margins", lambda scene, x: looks.append(1) or -np.ones(len(x)))
    scene, limit = pruned_scene(NominalProblem(PROBLEM, MODEL)), After(3)
    assert rare.where_safe(scene, np.random.default_rng(0), 8192, limit) is None
    assert limit.cut and len(looks) == 3  # the first plans, and two moves


@pytest.fixture
def draws(monkeypatch):
    """Sizes of draws, none of which has a safe plan."""
    sizes: list[int] = []

    def none_safe(scene, rng, n, within):
        sizes.append(n)
        return Draw(n, n, no_points(MODEL), 1.0)

    monkeypatch.setattr(search, "draw", none_safe)
    return sizes


def test_seconds_end_draws_of_plans_alone_and_are_told(draws):
    asked = (
        pruned_scene(NominalProblem(PROBLEM, MODEL)),
        KEY,
        np.random.default_rng(0),
        MOST + 1,
        0.99,
    )
    whole = search.draw_safe_plans(*asked, Limit(600.0))
    assert whole.ended is Ended.WORK and whole.hopeless and max(draws) == RARE_DRAW
    draws.clear()
    cut = search.draw_safe_plans(*asked, After(3))
    assert cut.ended is Ended.SECONDS and len(draws) == 3


def test_where_no_seconds_are_left_nothing_climbs_and_nothing_is_proved(draws, monkeypatch):
    monkeypatch.setattr(methods, "Limit", lambda seconds: After(1))
    monkeypatch.setattr(methods, "where_safe", None)
    answer = ask(pj.Settings.fast().replace(samples=MOST + 1))
    assert not answer.status.found and answer.cover.ended is Ended.SECONDS and len(draws) == 1
    assert "seconds, of which none were left" in answer.details()
    absence = answer.absence._replace(ended=Ended.WORK)  # before a climb that was cut off
    for text in (replace(answer, absence=absence).details(), answer.summary()):
        assert text.count("Search: ended by its") == 1 and Ended.SECONDS.sentence in text


def test_work_is_a_multiple_of_the_standard_and_never_nothing():
    assert work_of(1.0)[:3] == (LOOKS, CORRIDORS, LEAVES)
    assert work_of(2.0) == tuple(2 * n for n in work_of(1.0))
    assert min(work_of(1e-9)) == 1
