"""What every room stands on: float64 arrays, random streams, tolerances, exact numbers as text."""
