"""Wall time of every stage, and the compiler's share of it."""

import logging
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, contextmanager, nullcontext

import jax

_log = logging.getLogger(__name__)
_COMPILING = (
    "/jax/core/compile/backend_compile_duration",
    "/jax/core/compile/jaxpr_to_mlir_module_duration",
)
_spent = {"compile": 0.0}


def _listen(event: str, seconds: float, **_) -> None:
    if event in _COMPILING:
        _spent["compile"] += seconds


jax.monitoring.register_event_duration_secs_listener(_listen)


class Stopwatch:
    """Stages: {name: {"seconds": wall, "compile_seconds": in the compiler, over all threads}}.

    during: a context for each stage, by its name.
    """

    def __init__(self, during: Callable[[str], AbstractContextManager] = nullcontext):
        self.during = during
        self.stages: dict[str, dict[str, float]] = {}

    @contextmanager
    def __call__(self, stage: str):
        """Time a block. A stage that runs twice adds up."""
        _log.info("%s", stage)
        begin, compiled = time.perf_counter(), _spent["compile"]
        try:
            with self.during(stage):
                yield
        finally:
            entry = self.stages.setdefault(stage, {"seconds": 0.0, "compile_seconds": 0.0})
            took, of_it = time.perf_counter() - begin, _spent["compile"] - compiled
            entry["seconds"] += took
            entry["compile_seconds"] += of_it
            _log.info("%s: %.1f s, %.1f s of it compiling", stage, took, of_it)
