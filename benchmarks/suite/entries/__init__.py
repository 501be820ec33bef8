"""Entries of ours: baselines. Nothing here is needed to enter."""
