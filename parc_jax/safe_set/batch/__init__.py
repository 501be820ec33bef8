"""Thousands of scenes against one model in a few compiled calls: a safe plan for each."""
