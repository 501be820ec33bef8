"""The safe set for the computer of a robot: tables and a C99 header that needs nothing else."""
