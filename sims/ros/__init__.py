"""A node of ROS 2 that never stops being safe: measurements in, proved manoeuvres out. Only `node`
imports ROS (the extra `ros`); its pilot is `sims.pilot`. Answers and episodes for Foxglove:
`foxglove`.
"""
