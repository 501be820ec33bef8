"""What is asked: goal, obstacles, body, what of them is in doubt, and the names of coordinates."""
