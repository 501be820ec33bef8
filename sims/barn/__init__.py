"""A Jackal drives worlds of the BARN challenge on its lidar alone: 200 of the 300 static ones.

From "the-barn-challenge" (MIT licence beside this file); Perille, Truong, Xiao and Stone,
"Benchmarking Metric Ground Navigation", SSRR 2020.
"""

from sims.barn.contact import distance_to_cylinders
from sims.barn.job import job
from sims.barn.rectangles import rectangles
from sims.barn.worlds import World, metric, numbers, world

__all__ = ["World", "distance_to_cylinders", "job", "metric", "numbers", "rectangles", "world"]
