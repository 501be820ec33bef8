"""Separation: directions along which all of a part of the body, with its errors, is beyond all of
an obstacle during an interval. [T14, T19, T20]
"""
