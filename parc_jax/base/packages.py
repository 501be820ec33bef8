"""Packages of extras, which are loaded when something needs them."""

import importlib

from parc_jax.errors import InputError


def package(name: str, call: str, extra: str):
    """A package, for a call that needs it. Raises InputError where its extra is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise InputError(
            f"{call}: expected the package {name.split('.')[0]}; it is not installed. Try "
            f"pip install 'parc_jax[{extra}]'."
        ) from None
