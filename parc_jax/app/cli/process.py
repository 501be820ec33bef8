"""A command while it runs: its log, its signs of life, and Ctrl-C, all on stderr."""

import contextlib
import logging
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator

from parc_jax.common.errors import InputError

VARIABLE, OPTION = "PARC_JAX_LOG", "--verbose"
LEVELS = {"warning": logging.WARNING, "info": logging.INFO, "debug": logging.DEBUG}
STOPPED = 130  # exit code
_LOADING = "<frozen importlib"  # file of the frames of an import
COMPILING = "compiling"
SEARCHING = "looking for safe plans, or for a proof that there are none"
STAGES = {"first query (cold)": COMPILING, "safe set": SEARCHING}  # of a study, without a bar


class _BesideBars(logging.Handler):
    """Lines on stderr that progress bars make room for."""

    def emit(self, record: logging.LogRecord) -> None:
        from tqdm import tqdm

        tqdm.write(self.format(record), file=sys.stderr)


@contextlib.contextmanager
def logging_of(arguments: list[str]) -> Iterator[list[str]]:
    """Within, the logger "parc_jax" writes to stderr: "info" where OPTION is given, "debug" where
    it is given twice, or the level of VARIABLE.

    Yields the arguments without OPTION. Raises InputError.
    """
    word = os.environ.get(VARIABLE, "warning").lower()
    if word not in LEVELS:
        raise InputError(f"{VARIABLE}: expected one of {', '.join(LEVELS)}; got {word!r:.40}.")
    level = (logging.WARNING, logging.INFO, logging.DEBUG)[min(2, arguments.count(OPTION))]
    logger = logging.getLogger("parc_jax")
    before, handler = (logger.level, logger.propagate), _BesideBars()
    handler.setFormatter(logging.Formatter("%(asctime)s %(name)s: %(message)s", "%H:%M:%S"))
    logger.setLevel(min(level, LEVELS[word]))
    logger.addHandler(handler)
    logger.propagate = False  # a library may give the root logger a handler: all would come twice
    try:
        yield [word for word in arguments if word != OPTION]
    finally:
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


def saying(quiet: bool = False) -> Callable[[str], None]:
    """`say(stage)` names the present stage on stderr. quiet: nothing is said."""

    def say(stage: str) -> None:
        if not quiet:
            print(f"{stage} ...", file=sys.stderr, flush=True)

    return say


@contextlib.contextmanager
def during(stage: str, quiet: bool = False) -> Iterator[None]:
    """A stage of a study without a progress bar is named as by `solve`."""
    if stage in STAGES:
        saying(quiet)(STAGES[stage])
    yield
