"""One plan's verdict: a nominal problem as arrays, and whether a plan is safe for every run inside
the tube. [T11, T14]
"""
