"""Drive worlds of the BARN challenge on a lidar alone, or with the map: `python -m sims.barn`."""

import tyro

from sims.barn.series import Options, drive_worlds

if __name__ == "__main__":
    print(drive_worlds(tyro.cli(Options, description=__doc__))[1])
