"""Use of an answer by a robot: a tested plan, local claims, episodes, a C header."""
