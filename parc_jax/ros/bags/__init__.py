"""Bags of ROS 1 and 2, and MCAP: recorded runs out of them, answers and episodes into them. What
they are read and written with (the extra `bags`) is loaded when a bag is asked for.
"""
