"""Drive worlds of the BARN challenge on a lidar alone, or with the map: `python -m sims.barn`."""

import sys

import tyro

import parc_jax as pj
from sims.barn.series import Options, drive_worlds

if __name__ == "__main__":
    try:
        print(drive_worlds(tyro.cli(Options, description=__doc__))[1])
    except pj.InputError as error:
        sys.exit(f"error: {error}")
