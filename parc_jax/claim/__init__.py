"""How far the robot may be from the network: a profile, fresh runs, one number, and the claim that
says what the tube is worth. [T1]
"""
