"""Park: `python -m sims.parking --case 2`, or `--all`; docs/parking.md has the table."""

import sys

import tyro

import parc_jax as pj
from sims.parking.job import Options, good, park_all

if __name__ == "__main__":
    try:
        sys.exit(int(not good(park_all(tyro.cli(Options, description=__doc__)))))
    except pj.InputError as error:
        sys.exit(f"error: {error}")
