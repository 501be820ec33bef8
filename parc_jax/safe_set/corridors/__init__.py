"""Corridors that hold the safe set: drawn, chosen and counted until enough of it is covered.
[T27, T31]
"""
