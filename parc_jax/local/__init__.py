"""Local claims: the one plan that is driven, a small box around it, and what can honestly be said
of them. [T23, T24]
"""
