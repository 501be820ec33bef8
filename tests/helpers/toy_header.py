"""The header of the toy answer: with its own tube, of boxes, and with one between slanted faces."""

from pathlib import Path
from unittest.mock import patch

import numpy as np
import toy_query
from toy_bodies import random_faces

from parc_jax.drive.onboard.header import write_c
from parc_jax.drive.onboard.tables import Tables, in_numbers, tables

TUBES = ("boxes", "faces")


def toy_tables(tube: str = "boxes") -> Tables:
    """What the header reads of the toy answer, its errors allowed by such a tube."""
    known = tables(toy_query.answer())
    if tube == "boxes":
        return known
    lead = known.errors.half.shape[:3]
    faces = random_faces(np.random.default_rng(0), lead, 2, 0.01, around_zero=False)
    return known._replace(errors=in_numbers(faces.errors))


def write_toy(known: Tables, path: Path) -> Path:
    """The header of these tables."""
    with patch("parc_jax.drive.onboard.header.tables", lambda answer: known):
        return write_c(toy_query.answer(), path)
