"""Proofs that no plan exists, and bounds of the volume of the safe set: boxes of plans, split until
each is decided. [T30]
"""
