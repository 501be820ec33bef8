"""The world around the robot: outlines, maps and lidar scans as few convex obstacles that cover it.
Shapely and the like (the extra `maps`) are loaded on first use.
"""
