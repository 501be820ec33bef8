"""The page of `live` in a real browser: a grip is dragged by its mouse, and the plans follow."""

import socket
import time

import jax
import numpy as np
import pytest
from live_tab import Tab
from toy_models import line_model

import parc_jax as pj
from parc_jax.safe_set.verdict.pointwise import verdicts
from parc_jax.safe_set.verdict.scene import scene_of

pytestmark = [pytest.mark.slow, pytest.mark.needs("chromium", "viser")]

PHONE = {"width": 390, "height": 700, "deviceScaleFactor": 1, "mobile": True}


@pytest.fixture
def page():
    blocks = [pj.box([0.7, 0.3], [0.9, 2.0]), pj.box([0.7, -2.0], [0.9, -0.3])]
    goal = pj.box([1.4, -0.4, -9.0], [1.9, 0.4, 9.0])
    start = pj.box([-0.4, -0.4], [0.0, 0.4])
    problem = pj.reach_avoid(goal, blocks, 0.1, start)
    page = pj.figures.live(line_model(e=0.01, half=2.5), problem, port=_free(), wait=False)
    yield page
    page.stop()


def _free() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def settled(page, before: str = "") -> str:
    """The words beside the scene, once the set is measured again; the test's own clock ends it."""
    while page.told == before or "measured" not in page.told:
        time.sleep(0.05)
    return page.told


def words(markdown: str) -> str:
    """The first words of the plans, as a browser shows them."""
    return markdown.split("\n")[0].replace("**", "").split(",")[0]


def test_the_mouse_drags_a_grip_and_200_of_200_plans_agree_with_contains(
    page, tmp_path, monkeypatch
):
    """Every plan that was drawn on the way is safe where things were, and the measured set holds
    no plan that is not.
    """
    drawings, answers = [], []
    draw, settle = page.live.draw, page.live.settle

    def noted_draw(*of):
        drawn = draw(*of)
        drawings.append((drawn.scene.problem, drawn.plans))
        return drawn

    def noted_settle():
        answers.append(settle())
        return answers[-1]

    monkeypatch.setattr(page.live, "draw", noted_draw)
    monkeypatch.setattr(page.live, "settle", noted_settle)
    with Tab(page, tmp_path) as tab:
        before = settled(page)
        grip = page.live.grips["obstacle 0"]
        tab.drag("obstacle 0", 1, -0.15)
        after = settled(page, before)
        moved = page.live.grips["obstacle 0"].place - grip.place
        assert moved == pytest.approx([0.0, -0.15], abs=0.05) and moved[1] < -0.1
        assert "% of the plans whose" in after.replace("**", "")
        tab.drag("obstacle 0", 1, 0.3)
        settled(page, after)
        assert tab.complaints == []
    assert len({problem.obstacles[0].b.tobytes() for problem, _ in drawings}) > 10
    plans = 0
    for problem, drawn in drawings:
        seen = verdicts(scene_of(problem, page.live.model), drawn[:, :2], drawn[:, 2:])
        assert seen.safe.all()
        plans += len(drawn)
    assert plans >= 200
    for answer, _ in answers[-2:]:
        drawn = answer.sample(jax.random.PRNGKey(0), 100)
        off = drawn + np.random.default_rng(0).normal(0, 0.1, drawn.shape)
        each = np.clip(np.concatenate([drawn, off]), -2.5, 2.5)
        held = answer.contains(each[:, :2], each[:, 2:])
        seen = verdicts(scene_of(page_problem(answer), page.live.model), each[:, :2], each[:, 2:])
        assert held[:100].all() and not held.all() and (seen.safe | ~held).all()


def page_problem(answer):
    """The problem of an answer, all of its obstacles."""
    return answer.scene.nominal.problem


def test_two_browsers_see_the_same_and_who_leaves_loses_nothing(page, tmp_path):
    """Narrower by the obstacle that is moved, then closed; one of them is a phone."""
    middle = page.live.grips["obstacle 0"].middle
    (tmp_path / "second").mkdir()
    with Tab(page, tmp_path) as tab:
        tab.ask("Emulation.setDeviceMetricsOverride", **PHONE)
        before = settled(page)
        with Tab(page, tmp_path / "second") as second:
            page.move("obstacle 0", middle - np.array([0.0, 0.2]), 0.1)
            after = settled(page, before)
            assert after != before and "% of the plans whose" in after.replace("**", "")
            for each in (tab, second):
                each.wait(f"document.body.innerText.includes('{words(after)}')")
            assert second.complaints == []
        page.move("obstacle 0", middle - np.array([0.0, 0.45]))
        closed = settled(page, after)
        assert "0 safe plans" in closed and "between obstacle" in closed
        tab.wait("document.body.innerText.includes('between obstacle')")
        assert tab.run("document.documentElement.scrollWidth <= window.innerWidth")
        assert tab.complaints == []
