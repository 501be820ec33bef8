"""Local claims: the plan that is driven, a small box around it, what is known of it. [T23, T24]"""
