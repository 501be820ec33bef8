"""Piecewise affine structure of a ReLU network: all regions by exact subdivision, or one by one by
marching.
"""

from parc_jax.proof.regions.facets import MarchedRegion, march
from parc_jax.proof.regions.subdivide import enumerate_regions, regions_of
from parc_jax.proof.regions.table import RegionTable

__all__ = ["MarchedRegion", "RegionTable", "enumerate_regions", "march", "regions_of"]
