"""How many programs a call compiles, those that it finds in a folder of compiled ones too."""

import jax

_COMPILED: list[str] = []
jax.monitoring.register_event_duration_secs_listener(
    lambda event, seconds, **_: (
        _COMPILED.append(event) if event.endswith("backend_compile_duration") else None
    )
)


def compiled_by(call) -> int:
    """Programs that `call()` asks the compiler for."""
    before = len(_COMPILED)
    call()
    return len(_COMPILED) - before
