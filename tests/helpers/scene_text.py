"""Problems from the text of a scene file."""

import tempfile
from pathlib import Path

import parc_jax as pj


def problem_of_text(text, name="scene.toml", points=None):
    """The problem in the text of a file called `name`."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_text(text, encoding="utf-8")
        return pj.exchange.load_problem(path, points)
