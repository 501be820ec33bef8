"""Films of drives in one world, side by side, seen from above."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from parc_jax.app.plot.film import write_film
from parc_jax.app.plot.style import BLUE, GOAL, OBSTACLE, RED, sheet
from sims.point import world

RATE, COLOURS = 12.5, 32  # frames/s, of a .gif
SIZE, DPI, TAIL = 3.4, 80, 60  # [inch] of a drive; steps of the past that are drawn


class Frame(NamedTuple):
    """After a step: pose (3,) of the robot, the goal (2,) [m], the cost of this step, whether the
    shield drove another action.
    """

    pose: np.ndarray
    goal: np.ndarray
    cost: float
    changed: bool


def frame(env, info: dict) -> Frame:
    """What is there in an environment whose last step told info."""
    true, shield = env.unwrapped.world, info.get("shield", {})
    goal = true.layout["goal"].copy()
    return Frame(true.pose, goal, info.get("cost", 0.0), shield.get("changed", False))


def film(
    out: Path | str, hazards: np.ndarray, drives: Mapping[str, Sequence[Frame]], every: int = 4
) -> Path:
    """Write drives of equal length, by name, as a .gif. hazards (n, 2) [m]; every: steps of the
    environment from image to image. Returns its path.
    """
    length = min(map(len, drives.values()))
    images = [_image(hazards, drives, i) for i in range(0, length, every)]
    return write_film(Path(out), images, RATE, COLOURS)


def _image(hazards, drives: Mapping[str, Sequence[Frame]], now: int) -> np.ndarray:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.patches import Circle

    with sheet(None, (SIZE * len(drives), SIZE * 1.08), columns=len(drives)) as drawn:
        for ax, (name, frames) in zip(drawn.axes, drives.items(), strict=True):
            one, past = frames[now], frames[max(0, now - TAIL) : now + 1]
            ax.add_patch(Circle(tuple(one.goal), world.GOAL, color=GOAL))
            for place in hazards:
                touched = np.linalg.norm(one.pose[:2] - place) < world.HAZARD
                ax.add_patch(Circle(tuple(place), world.HAZARD, color=RED if touched else OBSTACLE))
            ax.plot(*np.array([f.pose[:2] for f in past]).T, color=BLUE, lw=1)
            x, y, heading = one.pose
            ax.plot(x, y, "o", color=BLUE, ms=8)
            ax.plot([x, x + 0.15 * np.cos(heading)], [y, y + 0.15 * np.sin(heading)], color=BLUE)
            spent = sum(f.cost for f in frames[: now + 1])
            told = ", changed" if one.changed else ""
            ax.set_title(f"{name}: cost {spent:.0f}{told}")
            ax.set(xlim=(-2, 2), ylim=(-2, 2), aspect="equal", xticks=[], yticks=[])
        drawn.figure.set_dpi(DPI)
        canvas = FigureCanvasAgg(drawn.figure)
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()
