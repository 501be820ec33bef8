"""`parc-jax check`: the independent checker."""

from pathlib import Path


def check(answer: Path, /, *, json: bool = False) -> int:
    """Verify the certificates of an answer in exact arithmetic; needs no JAX. Example: parc-jax check answer.json

    Args:
        answer: The answer file.
        json: Print the report as JSON.
    """
    from parc_jax import checker

    return checker.main([str(answer), *(["--json"] if json else [])])
