"""How often manoeuvres that were driven leave their tubes, each run again from the same start: a
search chose them, so no claim says it. `python -m sims.parking.again runs/parking`
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import jax
import numpy as np
import tyro

import parc_jax as pj
from parc_jax.common.spelling import rounded_up
from parc_jax.drive.loop.episode_file import load_episode
from parc_jax.learning.bound.measure import scores_of
from sims.parking import car as c
from sims.parking.predict import MODEL


@dataclass(frozen=True)
class Options:
    """Which files."""

    folder: Annotated[Path, tyro.conf.Positional]
    """A folder of episodes of the model below."""
    runs: int = 400
    """Of each manoeuvre."""
    model: Path = MODEL
    seed: int = 4242


def driven_in(folder: Path, model: pj.types.TrajectoryModel) -> list[tuple[str, np.ndarray]]:
    """Of all manoeuvres of a folder the name of their file and their k (5,). Raises InputError
    where there are none, or of another model.
    """
    driven = []
    for file in sorted(folder.glob("case_*.json")):
        episode = load_episode(file)
        claim = episode.model.claim
        # under an uncertainty of the heading the file's network is made of the model's
        of = claim.evidence.get("network_of_runs", claim.hash)
        if of not in (model.net.hash, model.claim.hash):
            raise pj.InputError(
                f"{file}: expected manoeuvres of the model whose runs are made; they are of "
                "another one. Name theirs with --model."
            )
        driven += [(file.stem, one.k) for one in episode.manoeuvres]
    if not driven:
        raise pj.InputError(f"expected a folder with case_N.json; {folder} has none.")
    return driven


def shares_left(net, tube, k: np.ndarray, runs: int, seed: int) -> np.ndarray:
    """(b,) of so many fresh runs of each k (b, 5) the share that leaves the tube."""
    again = np.repeat(k, runs, axis=0)
    batch = pj.learning.collect(
        c.system(), jax.random.PRNGKey(seed), len(again), k=again, quiet=True
    )
    return (scores_of(net, tube, [batch]).score.reshape(-1, runs) > 1).mean(axis=1)


if __name__ == "__main__":
    options = tyro.cli(Options, description=__doc__)
    try:
        model = pj.load(options.model, system="parking")
        driven = driven_in(options.folder, model)
    except pj.InputError as error:
        raise SystemExit(f"error: {error}") from None
    k, files = np.array([one for _, one in driven]), {name for name, _ in driven}
    left = shares_left(model.net, model.tube, k, options.runs, options.seed)
    worst = np.argsort(-left)[:3]
    print(f"{len(k)} manoeuvres of {len(files)} files, {options.runs} runs of each:")
    print(
        f"{rounded_up(100 * left.mean(), 2)} % of the runs leave the tube; of the worst manoeuvres"
    )
    for i in worst:
        print(f"{rounded_up(100 * left[i], 2)} %: {driven[i][0]}, k = {np.round(k[i], 3).tolist()}")
