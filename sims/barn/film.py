"""A drive as a film and a page: what the robot knew and committed to, what truly stands there."""

import json
from pathlib import Path

import numpy as np

from parc_jax.app import figures
from parc_jax.drive.loop.episode_file import episode_of, episode_part
from parc_jax.problem.robust.pose import Pose
from sims.barn.drive import Drive
from sims.barn.worlds import World
from sims.jackal.params import TICK

AROUND = np.stack([f(np.linspace(0, 2 * np.pi, 17)[:-1]) for f in (np.cos, np.sin)], axis=1)


def film(out: Path, world: World, one: Drive, quiet: bool = True) -> Path:
    """Film a drive in the world as it truly is, and write its page beside the film: what the robot
    told from where it held itself to be is shown from where it was. Raises InputError for a kind of
    file that is not known.
    """
    new = [step.new for step in one.steps]
    committed = [step.committed for step in one.steps if step.new]
    data = json.loads(json.dumps(episode_part(committed, {"reasons": one.reasons}, one.drift)))
    driven = episode_of(data, "film")
    true = [pose for (pose, _), begun in zip(one.poses, new, strict=True) if begun]
    placed = [
        manoeuvre._replace(pose=Pose(pose[:2], float(pose[2])))
        for manoeuvre, pose in zip(driven.manoeuvres, true, strict=True)
    ]
    truth = figures.Truth(
        TICK * np.arange(len(one.path)),
        one.path,
        list(world.cylinders[:, None] + world.radius * AROUND),
        list(_seen(one)),
    )
    driven = driven._replace(manoeuvres=tuple(placed))
    figures.write_page(driven, out.with_suffix(".html"), truth=truth)
    return figures.film(driven, out, run=truth, quiet=quiet)


def _seen(one: Drive):
    """When, and what of the world was known to be free from then on."""
    from shapely.affinity import rotate, translate

    seconds = np.linspace(0.0, TICK * (len(one.path) - 1), len(one.steps) + 1)[:-1]
    for begin, (true, told), free in zip(seconds, one.poses, one.free, strict=True):
        turned = rotate(free.region, true[2] - told[2], origin=tuple(told[:2]), use_radians=True)
        yield float(begin), translate(turned, *(true[:2] - told[:2]))
