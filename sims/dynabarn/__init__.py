"""A Jackal crosses a field in which cylinders walk: 40 of the 60 worlds of DynaBARN.

From "DynaBARN" (MIT licence beside this file); Nair et al., "DynaBARN: Benchmarking Metric Ground
Navigation in Dynamic Environments", SSRR 2022.
"""

from sims.dynabarn.worlds import KINDS, Law, World, numbers, world

__all__ = ["KINDS", "Law", "World", "numbers", "world"]
