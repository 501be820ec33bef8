"""What is asked: goal, obstacles, body, what of them is uncertain, and the names of coordinates."""
