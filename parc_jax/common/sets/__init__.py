"""Boxes and polytopes, and the operations on them that the engine needs."""
