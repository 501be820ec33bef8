"""Reward and cost while training, of tables of `sims.point.train`, in one picture:

python -m sims.point.curves runs/point --out docs/pictures/shield_training
"""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from parc_jax.app.plot.style import BLUE, ORANGE, RED, legend, mark, sheet
from sims.point.world import STEPS

WINDOW = 40_000  # steps of training that a point of a curve is the mean of
NAMED = {
    "behind": ("PPO behind the shield", BLUE),
    "bare": ("PPO", RED),
    "lagrangian": ("PPO with a Lagrangian, cost 25 allowed", ORANGE),
}


@dataclass(frozen=True)
class Options:
    """Where the tables are, and where the picture goes."""

    folder: Annotated[Path, tyro.conf.Positional]
    out: Path = Path("training")


def rates(file: Path) -> dict[str, np.ndarray]:
    """Of a table: reward and steps in contact in 1,000 steps, each over about so many before."""
    rows = list(csv.DictReader(file.read_text().splitlines()))
    steps, *sums = (
        np.array([0.0, *(float(row[name]) for row in rows)])
        for name in ("steps", "gained", "contact")
    )
    every = max(1, round(WINDOW / steps[1]))
    at = np.arange(0, len(steps), every)
    found = [STEPS * np.diff(total[at]) / np.diff(steps[at]) for total in sums]
    return {"steps": steps[at[1:]], "return": found[0], "cost": found[1]}


def main(options: Options) -> None:
    """Draw, and tell the last row of each."""
    with sheet(options.out, (6.4, 2.7), columns=2) as drawn:
        for name, (words, colour) in NAMED.items():
            for file in sorted(options.folder.glob(f"{name}*.csv")):
                table = rates(file)
                for ax, of in zip(drawn.axes, ("return", "cost"), strict=True):
                    ax.plot(table["steps"] / 1e3, table[of], color=colour, lw=1.2)
                print(words, file.stem, {of: round(x[-1], 2) for of, x in table.items()})
        for ax, of in zip(drawn.axes, ("reward", "cost"), strict=True):
            ax.set(xlabel="thousand steps of training", title=f"{of} in 1,000 steps")
            ax.set_xlim(left=0)
        drawn.axes[1].set_ylim(bottom=-2)
        drawn.axes[1].axhline(25, color="#C0C0C0", lw=0.8, zorder=0)
        legend(drawn.figure, [mark(words, color=c) for words, c in NAMED.values()], 3)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
