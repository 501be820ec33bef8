"""Optional packages of the black boxes in this folder: asked for when they are needed, by name."""

import importlib.util

from parc_jax.common.errors import InputError


def require(system: str, package: str, extra: str) -> None:
    """Refuse to build a system without its package. Raises InputError with the line that installs
    it.

    package: as it is imported. extra: of parc_jax, the one that brings it.
    """
    if importlib.util.find_spec(package) is None:
        raise InputError(
            f"system {system!r}: expected the package {package}, a simulator that parc_jax does "
            f"not bring along; it is not installed. Try: pip install 'parc_jax[{extra}]'"
        )
