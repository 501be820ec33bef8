"""Affine images of polytopes, and operations on sets, as the method is published in."""
