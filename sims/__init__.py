"""Black boxes to certify. `load(name)` builds one; parc_jax itself never imports this package."""

import importlib

OURS = ("drift_parking", "asv", "asv_published", "f110", "tractor", "drone", "jackal")
# black boxes that nobody here wrote, each behind an optional package or a log: `sims/foreign`
FOREIGN = ("slot", "towers", "kerb", "husky", "dynobench")
NAMES = OURS + FOREIGN
JOBS = ("barn",)  # of `parc-jax run` alone: episodes of a robot, not one question about it


def place(name: str) -> str:
    """The module that holds the system of that name."""
    room = "sims.foreign" if name in FOREIGN else "sims"
    return f"{room}.{name}"


def load(name: str, **options):
    """The system of that name, e.g. load("drift_parking", plant="ode"). Options go to its `system`
    constructor.
    """
    from parc_jax.errors import InputError

    if name not in NAMES:
        raise InputError(f"system: expected one of {', '.join(NAMES)}; got {name!r}.")
    return importlib.import_module(place(name)).system(**options)


def __getattr__(name: str):
    """sims.drift_parking and the others, loaded on first use."""
    if name not in NAMES + JOBS:
        raise AttributeError(f"module 'sims' has no attribute {name!r}")
    return importlib.import_module(place(name))
