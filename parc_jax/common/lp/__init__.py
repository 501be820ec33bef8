"""Linear programs with checked answers, one at a time."""
