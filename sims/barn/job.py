"""`parc-jax run barn`: drive a dozen worlds on odometry and a lidar alone, with the Jackal's model
that comes along, check and film every episode.
"""

import json as as_json
import sys
from pathlib import Path

from parc_jax.common.errors import InputError
from parc_jax.drive.loop.episode_file import load_episode
from sims.barn.driver import MODEL, file_name
from sims.barn.series import Options, drive_worlds
from sims.barn.worlds import numbers

WORLDS = tuple(numbers()[8::17])  # a dozen, of all densities


def job(
    *,
    out: Path = Path("runs/barn"),
    model: Path | None = None,
    seed: int = 0,
    figures: bool = True,
    quiet: bool = False,
    json: bool = False,
) -> int:
    """All of it. Returns 0 when it moved, touched nothing, and every file is accepted, else 1.

    Writes a line an episode (drives.jsonl), the episodes and their films below `out`. model:
    another one of the Jackal. Raises InputError.
    """
    if model is not None and not model.exists():
        raise InputError(f"model: expected a saved model of the Jackal; there is no {model}.")
    options = Options(
        worlds=WORLDS,
        first_seed=seed,
        model=model or MODEL,
        out=out / "drives.jsonl",
        odometry=True,
        save=out / "episodes",
        film=out / "films" if figures else None,
        quiet=quiet,
    )
    told, said = drive_worlds(options)
    moved = [one for one in told if one["committed"]]
    refused = []
    for one in moved:
        try:
            name = file_name(one["driver"], one["world"], (one["world"], seed))
            load_episode(out / "episodes" / f"{name}.json")
        except InputError as why:
            refused.append(str(why))
    print(*refused, sep="\n", end="\n" if refused else "", file=sys.stderr)
    if json:
        print(as_json.dumps({"episodes": told, "refused": refused}, indent=1))
    else:
        accepted = f"{len(moved) - len(refused)} of {len(moved)} episodes in which it moved"
        print(said, f"The checker accepts {accepted}.", sep="\n")
        print(f"Written to {out}. Verify with: parc-jax check {out / 'episodes'}/FILE")
    return int(not moved or bool(refused) or any(one["touched"] for one in told))
