"""Black boxes to certify. `load(name)` builds one, `model(name)` reads what was learned of it;
parc_jax itself never imports this package.
"""

import importlib
from pathlib import Path

OURS = ("drift_parking", "asv", "asv_published", "f110", "tractor", "drone", "jackal")
# black boxes that nobody here wrote, each behind an optional package or a log: `sims/foreign`
FOREIGN = ("slot", "towers", "kerb", "husky", "dynobench")
NAMES = OURS + FOREIGN
# of `parc-jax run` alone: episodes of a robot, not one question about it
JOBS = ("barn", "parking")


def place(name: str) -> str:
    """The module that holds the system of that name."""
    room = "sims.foreign" if name in FOREIGN else "sims"
    return f"{room}.{name}"


def load(name: str, **options):
    """The system of that name, e.g. load("drift_parking", plant="ode"). Options go to its `system`
    constructor.
    """
    from parc_jax.common.errors import InputError

    if name not in NAMES:
        raise InputError(f"system: expected one of {', '.join(NAMES)}; got {name!r}.")
    return importlib.import_module(place(name)).system(**options)


def model(name: str):
    """The `TrajectoryModel` that comes along with a system; docs/main_job.md says how each was
    learned, and its claim what it is worth. Raises InputError where none does.
    """
    from parc_jax.learning.model import load

    return load(model_file(name), system=name)


def model_file(name: str) -> Path:
    """Where the model that comes along with a system is. Raises InputError where none does."""
    from parc_jax.common.errors import InputError

    if name not in models():
        raise InputError(
            f"model: expected a system whose model comes along ({', '.join(models())}); got "
            f"{name!r}. Learn one: parc-jax learn {name} --out model.npz"
        )
    return _beside(name)


def models() -> tuple[str, ...]:
    """Names of the systems whose model comes along."""
    return tuple(name for name in NAMES if _beside(name).is_file())


def _beside(name: str) -> Path:
    return Path(__file__).parent.joinpath(*place(name).split(".")[1:], "model.npz")


def __getattr__(name: str):
    """sims.drift_parking and the others, loaded on first use."""
    if name not in NAMES + JOBS:
        raise AttributeError(f"module 'sims' has no attribute {name!r}")
    return importlib.import_module(place(name))
