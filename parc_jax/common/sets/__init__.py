"""Boxes and polytopes, and what the engine asks of them; more of it is in `published`."""
