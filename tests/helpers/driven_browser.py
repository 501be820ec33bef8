"""Chromium driven over a pipe, in real time: workers run, which they do not under a virtual
clock.
"""

import json
import os
import shutil
import subprocess
import time
from pathlib import Path

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--window-size=1300,900",
    "--remote-debugging-pipe",
)


def found() -> str | None:
    """A browser's path."""
    return next((path for path in map(shutil.which, BROWSERS) if path), None)


class Browser:
    """A page in a browser, to run scripts in. Use as a context."""

    def __init__(self, path: str, page: Path, flags=FLAGS, url: str | None = None):
        """At a file that says when it is ready, or at a url, with a profile beside `page`."""
        self._number, self._rest = 0, b""
        orders, self._orders = os.pipe()
        self._news, news = os.pipe()
        command = [path, *flags, f"--user-data-dir={page.with_name('driven')}", "about:blank"]
        os.set_inheritable(orders, True)
        os.set_inheritable(news, True)
        # the browser takes orders from 3 and answers on 4
        shell = f'exec "$0" "$@" 3<&{orders} 4>&{news}'
        self._process = subprocess.Popen(
            ["bash", "-c", shell, *command],
            pass_fds=(orders, news),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(orders)
        os.close(news)
        target = self._ask("Target.createTarget", url=url or page.as_uri())["targetId"]
        attached = self._ask("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        if url is None:
            self.wait("document.body && document.body.dataset.ready === '1'")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.terminate()
        self._process.wait()
        os.close(self._orders)
        os.close(self._news)

    def run(self, script: str):
        """The value of a script's last expression."""
        done = self._ask("Runtime.evaluate", self._session, expression=script, returnByValue=True)
        assert "exceptionDetails" not in done, done
        return done["result"].get("value")

    def wait(self, condition: str) -> None:
        """Until a condition holds; the clock that ends this is the test's own."""
        while not self.run(f"Boolean({condition})"):
            time.sleep(0.05)

    def _ask(self, method: str, session: str | None = None, **parameters) -> dict:
        self._number += 1
        order = {"id": self._number, "method": method, "params": parameters}
        if session is not None:
            order["sessionId"] = session
        os.write(self._orders, json.dumps(order).encode() + b"\0")
        while True:
            news = json.loads(self._read())
            if news.get("id") == self._number:
                assert "error" not in news, news
                return news["result"]

    def _read(self) -> bytes:
        while b"\0" not in self._rest:
            chunk = os.read(self._news, 1 << 16)
            assert chunk, "the browser has ended"
            self._rest += chunk
        first, self._rest = self._rest.split(b"\0", 1)
        return first
