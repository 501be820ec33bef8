"""What a command is doing while nothing else is to be seen: to stderr, so that its output stays
its own.
"""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

COMPILING = "compiling"
SEARCHING = "looking for safe plans, or for a proof that there are none"
STAGES = {"first query (cold)": COMPILING, "safe set": SEARCHING}  # of a study, without a bar
EVERY_S = {True: 1.0, False: 10.0}  # [s] between two signs of life: on a terminal, elsewhere


@contextmanager
def saying(quiet: bool = False) -> Iterator[Callable[[str], None]]:
    """Within, `say(what)` tells what is being done, and from time to time that it still is: on a
    terminal in one line that goes away, elsewhere in a line every ten seconds. quiet: say nothing.
    """
    if quiet:
        yield lambda what: None
        return
    sign = _Sign(sys.stderr)
    thread = threading.Thread(target=sign.go_on, daemon=True)
    thread.start()
    try:
        yield sign.say
    finally:
        sign.ended.set()
        thread.join()
        sign.clear()


@contextmanager
def during(stage: str, quiet: bool = False) -> Iterator[None]:
    """Within, a stage of a study that has no progress bar is told of like `solve`'s."""
    with saying(quiet or stage not in STAGES) as say:
        say(STAGES.get(stage, ""))
        yield


class _Sign:
    """A line on a stream that is kept alive from a thread."""

    def __init__(self, stream):
        self.stream = stream
        self.on_terminal = stream.isatty()
        self.ended = threading.Event()
        self.what = ""
        self.begin = time.perf_counter()

    def say(self, what: str) -> None:
        self.what, self.begin = what, time.perf_counter()
        self._write(f"{what} ...")

    def go_on(self) -> None:
        every = EVERY_S[self.on_terminal]
        while not self.ended.wait(every):
            spent = time.perf_counter() - self.begin
            if self.what and spent > every / 2:
                self._write(f"{self.what} ... {spent:.0f} s")

    def clear(self) -> None:
        if self.on_terminal and self.what:
            self._write("")

    def _write(self, line: str) -> None:
        self.stream.write(f"\r\x1b[K{line}" if self.on_terminal else f"{line}\n")
        self.stream.flush()
