"""`parc-jax collect`: some rows of a system's runs into a folder that several jobs fill."""

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
    part: str = "1/1",
    study: Annotated[
        dict,
        Offer("learning.settings.Learning", left_out="the study's, or ", only=("plant", "body")),
    ],
    shell: Annotated[Shell, Offer("app.cli.shell.Shell", only=("seed", "quiet", "cache"))],
) -> int:
    """Run rows of a system, or one job's part of them. Example: parc-jax collect drift_parking
    --rows 0:10000 --part 3/100 --into runs/drift

    Jobs with the same command but for --part fill one folder, in any order, on any machines that
    share it; a part that was stopped goes on where it was. When all are there: parc-jax learn
    FOLDER.

    Args:
        system: A system of `parc-jax systems`, or a module of yours with `system()`.
        into: The folder.
        rows: All rows of the folder, BEGIN:END. Row i depends on the seed and i alone.
        part: NUMBER/PARTS: the share of this job, from 1/PARTS on.
    """
    from parc_jax.app.cli.lock import held
    from parc_jax.app.cli.places import require_place
    from parc_jax.app.cli.systems import black_box_of, find, study_of
    from parc_jax.app.cli.unfinished import source_hash
    from parc_jax.app.study.cache import keep_compiled
    from parc_jax.common.keys import SEEDS, key_of
    from parc_jax.learning.runs.files import read_npz
    from parc_jax.learning.runs.parts import collect_part, part_of

    begin, end = _numbers("rows", rows, ":", "BEGIN:END, such as 0:10000")
    number, parts = _numbers("part", part, "/", "NUMBER/PARTS, such as 3/100")
    whole = range(begin, end)
    if not whole:
        raise InputError(f"rows: expected BEGIN:END with BEGIN < END; got {rows}.")
    if end > SEEDS:
        raise InputError(f"rows: expected row numbers below {SEEDS:,}; got {rows}.")
    own = part_of(whole, number, parts)
    require_place(into, folder=True)
    if shell.cache:
        keep_compiled()
    module = find(system, needed=("system",))
    asked = study_of(module, others=(), **study)
    black_box = black_box_of(module, asked.plant, asked.body)
    with held(into / f"rows {own[0]} to {own[-1]}"):
        key, program = key_of(shell.seed), source_hash(module)
        path = collect_part(black_box, key, whole, own, into, program, shell.quiet)
    n = len(read_npz(path)["k"])
    print(f"Rows {own[0]:,} to {own[-1]:,} are in {path}: {n:,} runs of {rows}.")
    return 0


def _numbers(option: str, given: str, between: str, expected: str) -> tuple[int, int]:
    """Two whole numbers. Raises InputError."""
    first, sign, second = given.partition(between)
    if not (sign and first.isdecimal() and second.isdecimal()) or len(given) > 20:
        raise InputError(f"{option}: expected {expected}; got {given!r:.40}.")
    return int(first), int(second)
