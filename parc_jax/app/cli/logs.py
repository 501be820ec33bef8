"""What a command does, told while it does it: the logger "parc_jax", turned up."""

import contextlib
import logging
import os
import sys
from collections.abc import Iterator

from parc_jax.common.errors import InputError

VARIABLE, OPTION = "PARC_JAX_LOG", "--verbose"
LEVELS = {"warning": logging.WARNING, "info": logging.INFO, "debug": logging.DEBUG}


class _BesideBars(logging.Handler):
    """Lines on stderr that progress bars make room for."""

    def emit(self, record: logging.LogRecord) -> None:
        from tqdm import tqdm

        tqdm.write(self.format(record), file=sys.stderr)


@contextlib.contextmanager
def told(arguments: list[str]) -> Iterator[list[str]]:
    """The arguments without OPTION; in here the logger "parc_jax" tells on stderr what goes on:
    "info" where the option is given, "debug" where it is twice, or as VARIABLE says. Raises
    InputError.
    """
    word = os.environ.get(VARIABLE, "warning").lower()
    if word not in LEVELS:
        raise InputError(f"{VARIABLE}: expected one of {', '.join(LEVELS)}; got {word!r:.40}.")
    asked = (logging.WARNING, logging.INFO, logging.DEBUG)[min(2, arguments.count(OPTION))]
    logger = logging.getLogger("parc_jax")
    before, handler = (logger.level, logger.propagate), _BesideBars()
    handler.setFormatter(logging.Formatter("%(asctime)s %(name)s: %(message)s", "%H:%M:%S"))
    logger.setLevel(min(asked, LEVELS[word]))
    logger.addHandler(handler)
    logger.propagate = False  # a library may give the root logger a handler: all would come twice
    try:
        yield [word for word in arguments if word != OPTION]
    finally:
        logger.removeHandler(handler)
        logger.setLevel(before[0])
        logger.propagate = before[1]
