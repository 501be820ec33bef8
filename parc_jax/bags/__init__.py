"""Bags of ROS 1 and 2, and MCAP: recorded runs out of them. The packages of the extra `bags` are
loaded on first use.
"""
