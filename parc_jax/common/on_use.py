"""Loaded on first use: names that a package offers, listed in the stub beside it, the
one that type checkers read too, and packages of extras.
"""

import importlib
import pkgutil
import re
import sys
from collections.abc import Callable
from pathlib import Path

from parc_jax.common.errors import InputError

MAPS, BAGS = dict.fromkeys(("shapely", "yaml", "PIL"), "maps"), {"rosbags": "bags", "mcap": "bags"}
EXTRAS = {**MAPS, **BAGS, "onnx": "exchange", "viser": "live"}  # which bring which packages
OFFER = re.compile(r"^from ([\w.]+) import (\w+) as \2$", re.M)


def on_use(package: str) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` for the package or module of that name."""
    file = Path(sys.modules[package].__file__).with_suffix(".pyi").name
    stub = pkgutil.get_data(package, file).decode("utf-8")
    home = {name: module for module, name in OFFER.findall(stub)}
    names = sorted(home)

    def load(name: str) -> object:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        holder = importlib.import_module(home[name])
        if name in vars(holder):
            return vars(holder)[name]
        return importlib.import_module(f"{home[name]}.{name}")

    return load, lambda: names, names


def package(name: str, call: str, extra: str = ""):
    """A package, for a call that needs it. extra: by default that of EXTRAS. Raises InputError."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise InputError(
            f"{call}: expected the package {name.split('.')[0]}; it is not installed. Try "
            f"pip install 'parc_jax[{extra or EXTRAS[name.partition('.')[0]]}]'."
        ) from None


class Late:
    """A package that is imported where something of it is used. Arguments as of `package`."""

    def __init__(self, *asked: str):
        self._asked = asked

    def __getattr__(self, name: str):
        return getattr(package(*self._asked), name)
