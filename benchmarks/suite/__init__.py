"""A benchmark of black-box reach-avoid that others can enter: `python -m benchmarks.suite`. What an
entry is, how it is scored, and what came of ours: docs/suite.md.

All of it but the boxes behind `boxes.robots` and the entries of ours needs NumPy alone.
"""
