"""Ctrl-C: one quiet end, at whatever moment."""

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Iterator

STOPPED = 130  # exit code
_LOADING = "<frozen importlib"  # what frames of an import come from


class Interrupts:
    """Whether Ctrl-C was pressed."""

    seen = False


@contextlib.contextmanager
def stoppable() -> Iterator[Interrupts]:
    """In here Ctrl-C raises KeyboardInterrupt, and is remembered: libraries swallow some. While
    modules are being loaded, where one that is cut off leaves the others broken, nothing has begun
    yet, and the process ends at once.
    """
    found = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield found
        return

    def stop(_, frame):
        found.seen = True
        if _is_loading(frame):
            print("parc-jax: stopped.", file=sys.stderr, flush=True)
            os._exit(STOPPED)
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, stop)
    try:
        yield found
    finally:
        signal.signal(signal.SIGINT, before)


def _is_loading(frame) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith(_LOADING):
            return True
        frame = frame.f_back
    return False
