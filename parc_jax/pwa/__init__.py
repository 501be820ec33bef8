"""Piecewise affine structure of a ReLU network: all regions by exact subdivision, or one by one by
marching.
"""

from parc_jax.pwa.marching import MarchedRegion, march
from parc_jax.pwa.subdivide import enumerate_regions
from parc_jax.pwa.table import RegionTable

__all__ = ["MarchedRegion", "RegionTable", "enumerate_regions", "march"]
