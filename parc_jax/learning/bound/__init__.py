"""How far the robot may be from the network: a profile, fresh runs, one number, a claim. [T1]"""
