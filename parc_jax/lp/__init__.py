"""Linear programs with checked answers: the calls of docs/lp.md are public."""
