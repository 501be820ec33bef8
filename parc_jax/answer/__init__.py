"""What a query returns: safe plans, corridors and polytopes, what is proved of them, and what they
are worth in words and numbers.
"""
