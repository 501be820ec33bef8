"""Attempts to break the tool, one command each: `python -m benchmarks.attacks NAME`. What they
found: docs/attacks.md.
"""
