"""Piecewise affine structure of a ReLU network: all regions, by exact subdivision."""

from parc_jax.proof.regions.subdivide import enumerate_regions, regions_of
from parc_jax.proof.regions.table import RegionTable

__all__ = ["RegionTable", "enumerate_regions", "regions_of"]
