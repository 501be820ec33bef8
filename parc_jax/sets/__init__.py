"""Sets, their operations and questions about them: the calls of docs/sets.md are public."""
