"""`parc-jax collect`: rows of a system's runs into a file that `learn` takes."""

from pathlib import Path
from typing import Annotated

from parc_jax.app.cli.offer import Offer
from parc_jax.app.cli.shell import Shell
from parc_jax.common.errors import InputError


def collect(
    system: str,
    /,
    *,
    into: Path,
    rows: str,
    study: Annotated[
        dict,
        Offer("learning.learn.Learning", left_out="the study's, or ", only=("plant", "body")),
    ],
    shell: Annotated[Shell, Offer("app.cli.shell.Shell", only=("seed", "quiet", "cache"))],
) -> int:
    """Run rows of a system. Example: parc-jax collect drift_parking --rows 0:10000
    --into runs/drift

    The file in the folder is named by its rows; what was stopped goes on where it was. Then:
    parc-jax learn FILE.

    Args:
        system: A system of `parc-jax systems`, or a module of yours with `system()`.
        into: The folder of the file.
        rows: BEGIN:END. Row i depends on the seed and i alone.
    """
    from parc_jax.app.cli.lock import held
    from parc_jax.app.cli.places import require_place
    from parc_jax.app.cli.systems import black_box_of, find, study_of
    from parc_jax.app.study.cache import keep_compiled
    from parc_jax.common.keys import SEEDS, key_of
    from parc_jax.learning.runs.collect import collect as collect_rows

    first, sign, last = rows.partition(":")
    if not (sign and first.isdecimal() and last.isdecimal()) or len(rows) > 20:
        raise InputError(f"rows: expected BEGIN:END, such as 0:10000; got {rows!r:.40}.")
    begin, end = int(first), int(last)
    if not begin < end:
        raise InputError(f"rows: expected BEGIN:END with BEGIN < END; got {rows}.")
    if end > SEEDS:
        raise InputError(f"rows: expected row numbers below {SEEDS:,}; got {rows}.")
    require_place(into, folder=True)
    if shell.cache:
        keep_compiled()
    module = find(system, needed=("system",))
    asked = study_of(module, **study)
    black_box = black_box_of(module, asked.plant, asked.body)
    path = into / f"rows_{begin:09d}_{end - 1:09d}.npz"
    with held(path):
        how = {"first_row": begin, "path": path, "quiet": shell.quiet}
        collect_rows(black_box, key_of(shell.seed), end - begin, **how)
    print(f"Rows {begin:,} to {end - 1:,} are in {path}.")
    return 0
