"""What a robot does with it: the plan that is driven, local claims, episodes, a C header."""
