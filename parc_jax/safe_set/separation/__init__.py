"""Separation: an obstacle and a part of the body are kept apart during an interval by a direction
along which all of the one, with its errors, is beyond all of the other. [T14, T19, T20]
"""
