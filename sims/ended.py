"""How commands end."""

import sys
from collections.abc import Callable

from parc_jax.common.errors import InputError


def ended(name: str, work: Callable[[], str]) -> int:
    """Print what some work says. Exit code 2 for invalid input, with its sentence.

    name: of the command. work: returns what is to be printed.
    """
    try:
        print(work())
    except InputError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 2
    return 0
