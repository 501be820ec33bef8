"""Wall time of every stage with the compiler's share apart."""

import time
from contextlib import contextmanager

import jax

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
    """Collects stages: {name: {"seconds": wall, "compile_seconds": spent in the compiler, summed
    over threads}}.
    """

    def __init__(self):
        self.stages: dict[str, dict[str, float]] = {}

    @contextmanager
    def __call__(self, stage: str):
        """Time a block. A stage that runs twice adds up."""
        begin = time.perf_counter()
        compiled = _spent["compile"]
        try:
            yield
        finally:
            entry = self.stages.setdefault(stage, {"seconds": 0.0, "compile_seconds": 0.0})
            entry["seconds"] += time.perf_counter() - begin
            entry["compile_seconds"] += _spent["compile"] - compiled
