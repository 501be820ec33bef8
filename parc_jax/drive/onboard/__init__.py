"""The safe set for a robot's own computer: tables and a C99 header that needs nothing else."""
