"""A command while it runs: its log, its signs of life, and Ctrl-C, all on stderr."""

import contextlib
import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator

OPTION, QUIET = "--verbose", "--quiet"
STOPPED = 130  # exit code
_LOADING = "<frozen importlib"  # file of the frames of an import
COMPILING = "compiling"
SEARCHING = "looking for safe plans, or for a proof that there are none, within --work and --budget"
STAGES = {"first query (cold)": COMPILING, "safe set": SEARCHING}  # of a study, without a bar
SIGN_S, SIGNING = 10.0, ("run", "learn", "solve")  # [s] between signs of life, and who gives some
_log = logging.getLogger(__name__)


class _BesideBars(logging.Handler):
    """Lines on stderr that progress bars make room for: records of at least `told`, and of the
    others the last one as a sign of life.
    """

    def __init__(self, told: int):
        super().__init__()
        self.told, self.last = told, ""

    def emit(self, record: logging.LogRecord) -> None:
        self.last = record.getMessage()
        if record.levelno >= self.told:
            from tqdm import tqdm

            tqdm.write(self.format(record), file=sys.stderr)

    def give_signs(self, over: threading.Event) -> None:
        """Until it is over, a line every SIGN_S in which no progress bar is on the screen."""
        begin = time.monotonic()
        while not over.wait(SIGN_S):
            bars = getattr(sys.modules.get("tqdm"), "tqdm", None)
            if self.last and not getattr(bars, "_instances", ()):
                print(f"{time.monotonic() - begin:.0f} s: {self.last}", file=sys.stderr, flush=True)


@contextlib.contextmanager
def logging_of(arguments: list[str]) -> Iterator[list[str]]:
    """Within, the logger "parc_jax" writes to stderr, all stages where OPTION is given; else
    commands of SIGNING give signs of life, unless they are QUIET.

    Yields the arguments without OPTION.
    """
    logger, over = logging.getLogger("parc_jax"), threading.Event()
    told = logging.INFO if OPTION in arguments else logging.WARNING
    before, handler = (logger.level, logger.propagate), _BesideBars(told)
    handler.setFormatter(logging.Formatter("%(asctime)s %(name)s: %(message)s", "%H:%M:%S"))
    signs = arguments[:1] and arguments[0] in SIGNING and not {OPTION, QUIET} & {*arguments}
    logger.setLevel(logging.INFO if signs else told)
    logger.addHandler(handler)
    logger.propagate = False  # a library may give the root logger a handler: all would come twice
    thread = threading.Thread(target=handler.give_signs, args=(over,), daemon=True)
    if signs:
        thread.start()
    try:
        yield [word for word in arguments if word != OPTION]
    finally:
        over.set()
        if signs:
            thread.join()
        logger.removeHandler(handler)
        logger.setLevel(before[0])
        logger.propagate = before[1]


@contextlib.contextmanager
def stoppable() -> Iterator[threading.Event]:
    """Within, Ctrl-C raises KeyboardInterrupt, and sets the event, since libraries swallow some.

    While modules are loaded the process ends at once: nothing has begun yet, and a module that is
    cut off would leave the others broken.
    """
    interrupts = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield interrupts
        return

    def stop(_, frame):
        interrupts.set()
        while frame is not None:
            if frame.f_code.co_filename.startswith(_LOADING):
                print("parc-jax: stopped.", file=sys.stderr, flush=True)
                os._exit(STOPPED)
            frame = frame.f_back
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, stop)
    try:
        yield interrupts
    finally:
        signal.signal(signal.SIGINT, before)


def say(stage: str, quiet: bool = False) -> None:
    """Name the present stage on stderr, and in signs of life. quiet: nothing is said."""
    _log.info("%s", stage)
    if not quiet:
        print(f"{stage} ...", file=sys.stderr, flush=True)


@contextlib.contextmanager
def during(stage: str, quiet: bool = False) -> Iterator[None]:
    """A stage of a study without a progress bar is named as by `solve`."""
    if stage in STAGES:
        say(STAGES[stage], quiet)
    yield
