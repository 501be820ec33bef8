"""What stands around the robot: outlines, maps, and only what a lidar saw, as few convex obstacles
that cover it. Shapely and the like (the extra `maps`) are loaded when something is asked of it.
"""
