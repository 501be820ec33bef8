"""Runs of a black box, or from files: the same for the same key, resumable, with their law."""
