"""One page of an episode that scrubs: a single file that needs no network and no server."""

from pathlib import Path

import numpy as np

from parc_jax.app.plot.html import filled
from parc_jax.app.plot.manoeuvres import Shown, Stage, Truth, polygons
from parc_jax.app.plot.shapes import span
from parc_jax.drive.loop.episode_file import Episode
from parc_jax.learning.runs.files import write_atomic

RATE = 25.0  # [1/s] moments that one can scrub to
DIGITS = 4  # of a metre


def write_episode_page(what: Episode | str | Path, html_path, truth: Truth | None = None) -> Path:
    """Write the page of an episode: a time slider, and at every moment the robot, its way, all that
    it may reach until it rests, where that is, the obstacles of that proof, and what was said.

    what, truth: as of `film_episode`. It is a picture; `parc-jax check` verifies the file. Where
    the file's `meta` has `{"reasons": [[seconds, why], ...]}`, the page says from when on, until
    the next manoeuvre, the robot went on with the stop in hand, and why. Raises InputError, also
    for an episode in space.
    """
    page = filled("episode.html", episode_data(Stage(what, truth)))
    return write_atomic(html_path, page.encode())


def episode_data(stage: Stage) -> dict:
    """JSON-able numbers of an episode, in metres and in seconds of the loop's clock."""
    moments = [stage.at(t) for t in stage.times(RATE)]
    lo, hi = span(*(one.tube for one in stage.shown))
    truth = Truth(np.zeros(0), np.zeros((0, 3))) if stage.truth is None else stage.truth
    return {
        "name": stage.name,
        "statement": stage.driven.statement,
        "k": stage.driven.model.labels.k,
        "step": 1 / RATE,
        "begin": stage.begin,
        "reach": float(stage.reach),
        "lo": lo.tolist(),
        "hi": hi.tolist(),
        "true": stage.truth is not None,
        "moments": [
            {"time": float(now.time), "number": now.number, "body": _short(now.body)}
            | {"middle": _short(now.middle)}
            for now in moments
        ],
        "manoeuvres": [_manoeuvre(one) for one in stage.shown],
        "obstacles": [len(one.problem.obstacles) for one in stage.driven.manoeuvres],
        "standing": _short(truth.standing),
        "seen": [[float(time), _rings(region)] for time, region in truth.seen],
        "reasons": reasons(stage.driven.meta),
    }


def reasons(meta) -> list[tuple[float, str]]:
    """When [s] no manoeuvre was found, and why, of what nobody checks: what fits, in order."""
    try:
        found = [(float(time), str(why)) for time, why in meta["reasons"]]
    except (TypeError, KeyError, ValueError):
        return []
    return sorted(one for one in found if np.isfinite(one[0]))


def _manoeuvre(one: Shown) -> dict:
    return {
        "begin": one.begin,
        "end": one.end,
        "k": one.k.tolist(),
        "tube": _short(one.tube),
        "obstacles": _short(one.obstacles),
        "rest": _short(one.rest),
    }


def _rings(region) -> list:
    """Of each part of a Shapely region its outline, then those of its holes."""
    return [
        _short([ring.coords for ring in (part.exterior, *part.interiors)])
        for part in polygons(region)
    ]


def _short(places) -> list:
    """Outlines (v, 2), or one place, rounded for a screen."""
    return [np.round(np.asarray(place), DIGITS).tolist() for place in places]
