"""`parc-jax export`: an answer for a robot's own computer."""

from pathlib import Path
from typing import Annotated

from parc_jax.cli.offer import Offer
from parc_jax.cli.shell import Shell


def export(
    answer: Path,
    /,
    *,
    c: Path,
    name: str | None = None,
    shell: Annotated[Shell, Offer("cli.shell.Shell", only=("quiet",))],
) -> int:
    """Write an answer as a C99 header without dependencies, with is_safe(p0, k) and
    nearest_plan. Example: parc-jax export answer.json --c safe_set.h

    Args:
        answer: An answer file of `solve` or `run`; it is checked anew.
        c: The header to write.
        name: What its functions begin with. Default: the name of the header.
    """
    from parc_jax.cli.places import require_place
    from parc_jax.io.answer_file import load_answer
    from parc_jax.onboard.header import write_c

    require_place(c)
    written = write_c(load_answer(answer), c, name)
    if not shell.quiet:
        print(f"{written}: {len(written.read_bytes()):,} bytes")
    return 0
