"""The page of `live` in a real browser: a grip is dragged by its mouse, and the plans follow."""

import json
import socket
import time

import driven_browser
import numpy as np
import pytest
from needs import need
from toy_models import line_model

import parc_jax as pj

pytestmark = pytest.mark.night

FLAGS = ("--enable-unsafe-swiftshader", "--use-angle=swiftshader")  # WebGL without a GPU
PHONE = {"width": 390, "height": 700, "deviceScaleFactor": 1, "mobile": True}


class Tab(driven_browser.Browser):
    """A browser at an address, which writes down what it complains of."""

    def __init__(self, url: str, folder, monkeypatch):
        flags = [flag for flag in driven_browser.FLAGS if flag != "--disable-gpu"]
        flags = [flag.replace("1300,900", "700,500") for flag in flags]
        monkeypatch.setattr(driven_browser, "FLAGS", (*flags, *FLAGS))
        self.news: list[dict] = []
        super().__init__(driven_browser.found(), _Address(url, folder))

    def wait(self, condition: str) -> None:
        if "dataset.ready" in condition:  # of the static page
            self.ask("Runtime.enable")
            self.ask("Log.enable")
            condition = "document.body && document.body.innerText.includes('safe plans')"
        super().wait(condition)

    def ask(self, method: str, **parameters) -> dict:
        return self._ask(method, self._session, **parameters)

    @property
    def complaints(self) -> list[dict]:
        bad = [n for n in self.news if n["method"] == "Runtime.exceptionThrown"]
        told = [n["params"] for n in self.news if n["method"] == "Runtime.consoleAPICalled"]
        return bad + [n for n in told if n["type"] == "error"]

    def _read(self) -> bytes:
        text = super()._read()
        if b'"method"' in text:
            self.news.append(json.loads(text))
        return text


class _Address:
    def __init__(self, url: str, folder):
        self.url, self.folder = url, folder

    def as_uri(self) -> str:
        return self.url

    def with_name(self, name: str):
        return self.folder / name


@pytest.fixture
def page():
    need("chromium", "viser")
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
    """What the page says, once the set is measured again; the test's own clock ends this."""
    while page.told == before or "measured" not in page.told:
        time.sleep(0.05)
    return page.told


def words(markdown: str) -> str:
    """The first words of the plans, as a browser shows them."""
    return markdown.split("\n")[0].replace("**", "").split(",")[0]


def test_a_drag_moves_an_obstacle_and_the_plans_follow_in_every_browser(
    page, tmp_path, monkeypatch
):
    """Narrower by the obstacle that is moved, then closed; a browser that leaves loses nothing."""
    url = f"http://127.0.0.1:{page.server.get_port()}"
    middle = page.live.grips["obstacle 0"].middle
    (tmp_path / "second").mkdir()
    with Tab(url, tmp_path, monkeypatch) as tab:
        tab.ask("Emulation.setDeviceMetricsOverride", **PHONE)
        before = settled(page)
        with Tab(url, tmp_path / "second", monkeypatch) as second:
            page.move("obstacle 0", middle - np.array([0.0, 0.2]), 0.1)
            after = settled(page, before)
            assert after != before and "% of the plans are safe" in after.replace("**", "")
            for each in (tab, second):
                each.wait(f"document.body.innerText.includes({json.dumps(words(after))})")
            assert second.complaints == []
        page.move("obstacle 0", middle - np.array([0.0, 0.45]))
        closed = settled(page, after)
        assert "0 safe plans" in closed and "between obstacle" in closed
        tab.wait("document.body.innerText.includes('between obstacle')")
        assert tab.run("document.documentElement.scrollWidth <= window.innerWidth")
        assert tab.complaints == []
