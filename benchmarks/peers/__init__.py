"""Other programs on the one piece we share with them: boxes around what a network says over a box
of inputs.
"""
