"""Safe plans between the rows of towers, flown: the whole scene, and the aeroplane in the gap.

python -m sims.foreign.towers.picture runs/towers/answer.json --out towers.png
"""

from pathlib import Path

import numpy as np

from parc_jax.app.files.answer_file import load_answer
from parc_jax.app.plot import shapes, style
from parc_jax.app.plot.shapes import predicted
from sims.foreign.towers import params as c
from sims.foreign.towers.flight import fly_from

NEAR = 60.0  # [m] shown on both sides of the gap
EVERY = 5  # records between two outlines of the aeroplane in the gap


def picture(answer: Path, out: Path, plans: int = 30, seed: int = 0) -> Path:
    """Draw the first safe plans of an answer, each flown once. Raises InputError.

    Args:
        answer: The answer's file.
        out: The picture.
        plans: How many.
        seed: Of the turbulence.
    """
    loaded = load_answer(answer)
    samples = loaded.samples[:plans]
    flights = [_flown(plan, [seed, row]) for row, plan in enumerate(samples)]
    path, _, error = predicted(loaded.model, samples)
    tubes = shapes.tubes(path[:, :, None, :2].swapaxes(1, 2), error[:, :, None, :2].swapaxes(1, 2))
    with style.sheet(out, (10.0, 3.9), columns=2, width_ratios=[1.9, 1.0]) as sheet:
        for ax in sheet.axes:
            _scene(ax, loaded.problem, tubes)
            for flight in flights:
                ax.plot(*flight[:, 0].T, color=style.BLACK, linewidth=0.5, alpha=0.7, zorder=4)
            ax.set_aspect("equal")
            ax.set_xlabel("x, east [m]")
        whole, near = sheet.axes
        whole.set_ylabel("y, north [m]")
        whole.set_xlim(-650, 730)
        whole.set_ylim(-300, 300)
        whole.set_title(f"{len(flights)} safe plans, flown in JSBSim")
        near.set_xlim(-NEAR, NEAR)
        near.set_ylim(-NEAR, NEAR)
        near.set_title(f"five of them every {EVERY * c.RECORD:g} s in the gap")
        for flight in flights[:5]:
            for outline in flight[::EVERY]:
                near.fill(*outline.T, facecolor=style.SKY, edgecolor=style.BLUE, zorder=5)
    return out


def _flown(plan: np.ndarray, seed: list[int]) -> np.ndarray:
    """Points (201, 5, 2) [m] on the map of one flight of a plan (p0, k)."""
    p, _ = fly_from(np.random.default_rng(seed), plan[2:], plan[:2])
    return p - p[0, 0] + plan[:2]


def _scene(ax, problem, tubes) -> None:
    """Towers, goal, and the tubes (n, 1, T, 6, 2) of the nose."""
    from matplotlib.collections import PolyCollection

    swept = PolyCollection(tubes.reshape(-1, 6, 2), facecolors="#D6E8F5", edgecolors="none")
    ax.add_collection(swept)
    (goal,) = (outline for _, (outline,) in shapes.goals(problem.goal, 2, 5, [(0, 1)]))
    ax.fill(*goal.T, facecolor=style.GREEN, alpha=0.25, edgecolor="none", zorder=2)
    for row in problem.obstacles:
        ax.fill(*shapes.shadow(row, (0, 1)).T, facecolor="#6E6E6E", edgecolor="none", zorder=3)


if __name__ == "__main__":
    import tyro

    tyro.cli(picture)
