"""Return and cost while training, of tables of `sims.point.train`, in one picture:

python -m sims.point.curves runs/point --out docs/pictures/shield_training
"""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from parc_jax.app.plot.style import BLUE, ORANGE, RED, legend, mark, sheet

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


def read(file: Path) -> dict[str, np.ndarray]:
    """Columns of a table by name, in rows in which episodes ended."""
    rows = list(csv.DictReader(file.open()))
    table = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    new = np.diff(table["episodes"], prepend=0) > 0
    return {name: values[new] for name, values in table.items()}


def main(options: Options) -> None:
    """Draw, and tell the last row of each."""
    with sheet(options.out, (6.4, 2.7), columns=2) as drawn:
        for name, (words, colour) in NAMED.items():
            table = read(options.folder / f"{name}.csv")
            for ax, of in zip(drawn.axes, ("return", "cost"), strict=True):
                ax.plot(table["steps"] / 1e3, table[of], ".-", color=colour)
                ax.set(xlabel="thousand steps of training", title=f"{of} of an episode")
                ax.set_xlim(left=0)
            last = {of: values[-1] for of, values in table.items()}
            print(words, {of: float(value) for of, value in last.items()})
        drawn.axes[1].set_ylim(bottom=-2)
        drawn.axes[1].axhline(25, color="#C0C0C0", lw=0.8, zorder=0)
        legend(drawn.figure, [mark(words, color=c) for words, c in NAMED.values()], 3)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
