"""Uncertainty lowered: a query with measured poses, execution errors, measured obstacles and goals
becomes a nominal problem. [T21, T22]
"""
