"""`parc-jax systems`, and finding a system by name."""

import importlib
import inspect
from types import ModuleType

from parc_jax.errors import InputError


def systems() -> int:
    """List the systems that `run` knows. Example: parc-jax systems"""
    for name in known():
        print(f"{name:16} {(find(name).__doc__ or '').splitlines()[0]}")
    return 0


def known() -> tuple[str, ...]:
    """Names of the systems that come with the package and are installed."""
    sims = importlib.import_module("sims")
    return tuple(name for name in sims.NAMES if importlib.util.find_spec(f"sims.{name}"))


def find(name: str) -> ModuleType:
    """The module of a system: one of `known`, or any importable module with `system()` and `problem()`."""
    target = f"sims.{name}" if name in known() else name
    try:
        module = importlib.import_module(target)
    except ModuleNotFoundError as error:
        raise InputError(
            f"system: expected one of {', '.join(known())}, or a module of your own; got {name!r} ({error})."
        ) from None
    for needed in ("system", "problem"):
        if not callable(getattr(module, needed, None)):
            raise InputError(f"system {name!r}: expected a function `{needed}()` in module {target}; there is none.")
    return module


def build(module: ModuleType, function: str, **options):
    """Call module.system or module.problem with the options that were given. Raises InputError for unknown ones."""
    chosen = {key: value for key, value in options.items() if value is not None}
    target = getattr(module, function)
    takes = inspect.signature(target).parameters
    for key in chosen:
        if key not in takes:
            known_options = ", ".join(takes) or "no options"
            raise InputError(f"{key}: expected an option of {module.__name__}.{function} ({known_options}).")
    return target(**chosen)
