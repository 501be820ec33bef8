"""The header of the toy answer: with its own tube, of boxes, and with one between slanted faces."""

from pathlib import Path
from unittest.mock import patch

import numpy as np
import toy_query
from toy_bodies import random_faces

from benchmarks.compiled_header import Header
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
    """The header of these tables, which may be those of another tube than the answer's."""
    header = "parc_jax.drive.onboard.header"
    compared = patch(f"{header}.require_kept", lambda *_: {})
    with patch(f"{header}.tables", lambda answer: known), compared:
        return write_c(toy_query.answer(), path)


def border_pairs(header: Header, answer, n: int) -> np.ndarray:
    """Pairs of plans (n, 2, n_p + n_k) that differ as little as floats can: the first one is safe,
    as the header says, the second is not.
    """
    rng = np.random.default_rng(3)
    n_p = answer.model.n_p
    safe = answer.samples[rng.integers(0, len(answer.samples), n)]
    other = safe + rng.normal(size=safe.shape) * rng.choice([0.0, 0.3], safe.shape)
    domain = answer.model.domain
    other[:, n_p:] = np.clip(other[:, n_p:], domain.lo, domain.hi)
    found, beyond = (header.are_safe(x[:, :n_p], x[:, n_p:]) for x in (safe, other))
    safe, other = safe[found & ~beyond], other[found & ~beyond]
    for _ in range(70):
        middle = safe + 0.5 * (other - safe)
        inside = header.are_safe(middle[:, :n_p], middle[:, n_p:])[:, None]
        safe, other = np.where(inside, middle, safe), np.where(inside, other, middle)
    return np.stack([safe, other], axis=1)
