"""Black boxes that can be run: JAX, Python, FMUs, fleets of machines, chains of manoeuvres."""
