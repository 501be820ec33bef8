"""Proofs that no plan exists: boxes of plans, split until each is decided. [T30]"""
