"""A node of ROS 2 that never stops being safe: what is measured goes in, proved manoeuvres come
out. Only `node` knows ROS (the extra `ros`); `pilot` is told messages of whoever decoded them.
"""
