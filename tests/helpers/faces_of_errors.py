"""Errors between faces that are told in fractions, as the checker keeps them."""

from parc_jax.checker.errors import Template
from parc_jax.checker.exact import integers


def template_of(rows, n: int, ways=()) -> Template:
    """Of rows (a, b) in n dimensions."""
    whole, scale = integers([x for a, b in rows for x in (*a, b)])
    each = [whole[i : i + n + 1] for i in range(0, len(whole), n + 1)]
    return Template([(row[:n], row[n]) for row in each], scale, n, ways)
