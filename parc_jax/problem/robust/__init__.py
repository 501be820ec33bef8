"""A question under uncertainty as a plain question: poses measured, commands executed roughly,
obstacles and goals seen with error. [T21, T22]
"""
