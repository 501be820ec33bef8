"""Black boxes that can be run: JAX, Python, fleets of machines, chains of manoeuvres."""
