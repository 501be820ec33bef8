"""CRAX's Point: its task at three levels, its manoeuvre, and what a shield asks of it."""

from pathlib import Path

from sims.crax.sensing import door, system

__all__ = ["door", "model", "system"]


def model():
    """The model that comes along; `python -m sims.point.learn --robot crax` made it."""
    from parc_jax.learning.model import load

    return load(Path(__file__).with_name("model.npz"), system="crax point")
