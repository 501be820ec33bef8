"""The problem: goal, obstacles, body, maps, uncertainty; lowered to one nominal problem."""
