"""One plan's verdict: a question laid out for a model, and whether a plan is safe for every run
inside the tube. [T11, T14]
"""
