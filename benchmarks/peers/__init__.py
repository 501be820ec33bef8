"""Other programs on the one piece we share with them: boxes around what a network says over a box
of inputs; and one safety question of an answer as files for any of them.
"""
