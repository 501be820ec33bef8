"""Safety-Gymnasium's Point, which slides: its task, its manoeuvre, and what a shield asks of it."""

from pathlib import Path

from sims.point.environment import PointGoal
from sims.point.manoeuvre import Point, system
from sims.point.sensing import door

__all__ = ["Point", "PointGoal", "door", "model", "system"]


def model():
    """The model that comes along; `python -m sims.point.learn` made it."""
    from parc_jax.learning.model import load

    return load(Path(__file__).with_name("model.npz"), system="point")
