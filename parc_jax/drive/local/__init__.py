"""The plan to drive: fresh runs of it, a claim about a small box around it. [T23, T24]"""
