"""How much work a call is, in function calls: the same on every machine, however busy."""

import contextlib
import cProfile
from pathlib import Path

import jaxtyping


@contextlib.contextmanager
def as_installed():
    """Without the checks of annotated shapes, which only tests have and which cost more than what
    they look at.
    """
    before = jaxtyping.config.jaxtyping_disable
    jaxtyping.config.update("jaxtyping_disable", True)
    try:
        yield
    finally:
        jaxtyping.config.update("jaxtyping_disable", before)


def calls_of(work) -> int:
    """How many functions `work()` calls, those of extensions too; as installed."""
    profile = cProfile.Profile()
    with as_installed():
        profile.runcall(work)
    own = Path(jaxtyping.__file__).parent
    return sum(
        entry.callcount
        for entry in profile.getstats()
        if isinstance(entry.code, str) or own not in Path(entry.code.co_filename).parents
    )
