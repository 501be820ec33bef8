"""The result of a query: safe plans and corridors, their proof, coverage and risk, in numbers and
words.
"""
