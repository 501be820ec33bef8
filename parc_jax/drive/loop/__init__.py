"""Episodes: one proved manoeuvre after another, each with its stop in hand. [T37, T38]"""
