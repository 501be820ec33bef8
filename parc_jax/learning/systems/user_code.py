"""The user's code, apart from libraries, and one sentence for an error in it.

Standard library only: worker processes import it.
"""

import contextlib
import re
import sysconfig
import traceback
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from parc_jax.common.errors import InputError, ParcError

_LIBRARIES = {sysconfig.get_path(x) for x in ("stdlib", "platstdlib", "purelib", "platlib")}
_LIBRARIES.add(str(Path(__file__).parents[2]))  # this package
_LONGEST = 300  # characters of a foreign message
_IN_TEXT = re.compile(r'File "([^"]+)", line (\d+)')  # tracebacks that come as text, of callbacks
_MISCALLED = re.compile(r"\S+\(\) (takes|missing|got) ")  # a call that does not fit


@lru_cache(maxsize=4096)
def is_own(filename: str) -> bool:
    """Whether a file is the user's: not of Python, an installed library or this package."""
    path = Path(filename)
    if filename.startswith(("<frozen", "<@")) or {"site-packages", "dist-packages"} & {*path.parts}:
        return False
    return not any(path.is_relative_to(folder) for folder in _LIBRARIES)


def own_place(error: BaseException) -> str | None:
    """File, line and text of the innermost line of the user's code that the error passed."""
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        if is_own(frame.filename):
            text = f" (`{frame.line}`)" if frame.line else ""
            return f"{frame.filename}, line {frame.lineno}{text}"
    for filename, line in reversed(_IN_TEXT.findall(str(error))):
        if is_own(filename):
            return f"{filename}, line {line}"
    return None


def said(error: BaseException) -> str:
    """Type and first line of an error."""
    text = next((line.strip() for line in str(error).splitlines() if line.strip()), "")
    return f"{type(error).__name__}: {text[:_LONGEST]}".rstrip(": .")


@contextlib.contextmanager
def blamed(expected: str) -> Iterator[None]:
    """Turns an error in the user's code into an InputError with file and line, or without where the
    call does not fit; errors of this package pass. expected: the beginning of the message.
    """
    try:
        yield
    except ParcError:
        raise
    except Exception as error:
        place = f" in {where}" if (where := own_place(error)) else ""
        if not (place or (isinstance(error, TypeError) and _MISCALLED.match(str(error)))):
            raise
        raise InputError(f"{expected}; it fails{place}: {said(error)}.") from error
