"""The result of a query: safe plans and corridors, their proof, coverage, risk, in words."""
