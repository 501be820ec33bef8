"""Worlds of the BARN challenge: 200 of its 300 static ones, their start, goal and measure.

From "the-barn-challenge" (MIT licence beside this file); Perille, Truong, Xiao and Stone,
"Benchmarking Metric Ground Navigation", SSRR 2020.
"""

from sims.barn.contact import distance_to_cylinders
from sims.barn.rectangles import rectangles
from sims.barn.worlds import World, metric, numbers, world

__all__ = ["World", "distance_to_cylinders", "metric", "numbers", "rectangles", "world"]
