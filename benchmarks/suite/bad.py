"""What makes no sense, in one sentence: what was expected, what came, what to try."""


class Refused(ValueError):
    """An instance, a scene, a request or an answer that cannot be taken."""
