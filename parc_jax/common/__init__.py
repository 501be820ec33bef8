"""Foundations of all folders: arrays, keys, tolerances, exact numbers, premises, errors."""
