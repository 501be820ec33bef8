"""The page of `live` in a real browser: its mouse, its screen, and its complaints."""

import base64
import json
import time
from pathlib import Path

import driven_browser
import numpy as np

# WebGL without a GPU
FLAGS = (
    *(flag for flag in driven_browser.FLAGS if flag != "--disable-gpu"),
    "--enable-unsafe-swiftshader",
    "--use-angle=swiftshader",
)
ALONG = 0.7  # of the length of a grip's arrows: where the mouse takes them
STEPS, PAUSE = 12, 0.08  # of a drag; [s] between two of them


class Tab(driven_browser.Browser):
    """A browser at the page, of a size [pixels]; its profile goes into a folder."""

    def __init__(self, page, folder: Path, size=(700, 500)):
        self.page, self.news = page, []
        before = set(page.server.get_clients())
        width, height = size
        flags = [f"--window-size={width},{height}" if "window" in f else f for f in FLAGS]
        url = f"http://127.0.0.1:{page.server.get_port()}"
        super().__init__(driven_browser.found(), folder / "page", flags, url)
        self.ask("Runtime.enable")
        self.wait("document.body && document.body.innerText.includes('safe plans')")
        (new,) = set(page.server.get_clients()) - before
        self._camera = page.server.get_clients()[new].camera
        time.sleep(3.0)  # to the first picture, and to the notice that lies over it

    def ask(self, method: str, **parameters) -> dict:
        """An order of the Chrome DevTools protocol."""
        return self._ask(method, self._session, **parameters)

    @property
    def complaints(self) -> list[dict]:
        """Errors of its console."""
        bad = [n for n in self.news if n["method"] == "Runtime.exceptionThrown"]
        told = [n["params"] for n in self.news if n["method"] == "Runtime.consoleAPICalled"]
        return bad + [n for n in told if n["type"] == "error"]

    def picture(self) -> bytes:
        """The screen as PNG."""
        return base64.b64decode(self.ask("Page.captureScreenshot", format="png")["data"])

    def where(self, place) -> np.ndarray:
        """(2,) [pixels] of a place (n_p,) [m] on the screen."""
        from viser.transforms import SO3

        camera, place = self._camera, np.r_[np.asarray(place, float), 0.0][:3]
        seen = SO3(np.array(camera.wxyz)).as_matrix().T @ (place - np.array(camera.position))
        box = "document.querySelector('canvas').getBoundingClientRect()"
        size = np.array(json.loads(self.run(f"JSON.stringify([{box}.width, {box}.height])")))
        return size / 2 + size[1] / 2 / np.tan(camera.fov / 2) * seen[:2] / seen[2]

    def drag(self, name: str, axis: int, by: float, each=lambda: None) -> None:
        """Drag a grip by its arrow along an axis, so many metres. each: called after every step."""
        place, along = self.page.live.grips[name].place, np.eye(2)[axis]
        begin = self.where(place + ALONG * 0.1 * self.page.size * along)
        way = self.where(place + by * along) - self.where(place)
        notices = "document.querySelectorAll('[class*=Notification] button')"
        self.run(f"{notices}.forEach(button => button.click())")  # they lie over the scene
        time.sleep(0.5)
        self._mouse("mouseMoved", begin)
        time.sleep(0.5)  # it looks under the mouse once a frame
        self._mouse("mousePressed", begin, button="left", clickCount=1)
        for step in range(1, STEPS + 1):
            time.sleep(PAUSE)
            self._mouse("mouseMoved", begin + step / STEPS * way, button="left", buttons=1)
            each()
        time.sleep(PAUSE)
        self._mouse("mouseReleased", begin + way, button="left", clickCount=1)

    def _mouse(self, kind: str, at, **more) -> None:
        self.ask("Input.dispatchMouseEvent", type=kind, x=float(at[0]), y=float(at[1]), **more)

    def _read(self) -> bytes:
        text = super()._read()
        if b'"method"' in text:
            self.news.append(json.loads(text))
        return text
