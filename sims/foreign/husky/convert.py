"""How husky.npz was made: whole steps of a recording, at the rate of its poses, in half the bytes.

    python -m sims.foreign.husky.convert husky_tile_steps.npz --out husky.npz

The input holds t (n_t,), p (n, n_t, 2), yaw (n, n_t), cmd_wheel (n, 2), command_id (n,),
complete (n,) and meta. What is left away: measured wheel speeds, every second record (linear
interpolations between poses that come at 10 Hz), and digits beyond single precision.
"""

import argparse
from pathlib import Path

import numpy as np

from parc_jax.learning.runs.files import read_npz, write_npz

EVERY = 2  # records of 20 Hz


def convert(source: Path, out: Path) -> None:
    """Write the complete steps of `source` to `out`. Raises InputError for a file that is none."""
    steps = read_npz(source)
    whole = steps["complete"]
    single = np.float32
    write_npz(
        out,
        {
            "t": steps["t"][::EVERY],
            "p": steps["p"][whole, ::EVERY].astype(single),
            "yaw": steps["yaw"][whole, ::EVERY].astype(single),
            "command": steps["cmd_wheel"][whole],
            "number": steps["command_id"][whole],
            "source": steps["meta"],
        },
    )


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    convert(given.source, given.out)


if __name__ == "__main__":
    main()
