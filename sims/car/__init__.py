"""Safety-Gymnasium's Car: its task, its manoeuvre, and what a shield asks of it."""

from pathlib import Path

from sims.car.manoeuvre import Car, system
from sims.car.sensing import door
from sims.point.environment import CarGoal

__all__ = ["Car", "CarGoal", "door", "model", "system"]


def model():
    """The model that comes along; `python -m sims.point.learn --robot car` made it."""
    from parc_jax.learning.model import load

    return load(Path(__file__).with_name("model.npz"), system="car")
