"""Corridors and polytopes that hold the safe set: drawn, chosen, cut and counted until enough of it
is covered. [T27, T31]
"""
