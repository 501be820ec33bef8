"""An episode at a time, for its film and its page: one manoeuvre after another, each with the
reachable set of the body and the stop that it ends in. In the plane.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from parc_jax.answer.path import NominalPath, nominal_path
from parc_jax.app.plot.shapes import footprints, in_world, obstacle_triangles, tube_triangles
from parc_jax.common.arrays import as_float64
from parc_jax.common.errors import InputError, shown
from parc_jax.drive.loop.episode_file import Episode, Manoeuvre, load_episode
from parc_jax.learning.bound.statement import UNSHOWN
from parc_jax.problem.body import numbered
from parc_jax.problem.robust.pose import Pose

# of the premises of a file, in short
NOTES = {"TUBE_LEFT": "some tube was left", "assumed clock:": "seconds are its clock's"}
REACH = 1.6  # [m] half width of the picture around the robot; more where a manoeuvre needs it
SAME = 1e-9  # [s] moments that are one


class Truth(NamedTuple):
    """The true run of an episode. times (n,) [s] of the loop's clock and poses (n, 3) x, y [m],
    heading [rad]: of the robot. standing: outlines (v, 2) [m] of the true obstacles. free: (time
    [s], Shapely region) of places observed to be free from then on.
    """

    times: np.ndarray
    poses: np.ndarray
    standing: Sequence[np.ndarray] = ()
    free: Sequence[tuple[float, Any]] = ()


class Shown:
    """One manoeuvre in the world: triangles (t, 3, 2) [m] of the tube that its body sweeps and of
    the obstacles that it was proved against; outlines (v, 2) [m] of the body at its rest.
    """

    def __init__(self, driven: Episode, one: Manoeuvre):
        self.begin, self.pose, self.k = float(one.begin), one.pose, one.k
        self.path: NominalPath = nominal_path(driven.model, one.p0, one.k)
        self.end = self.begin + float(self.path.times[-1])  # [s] of its rest, on the loop's clock
        self.parts = numbered(one.problem.body, driven.model.points)
        tube = tube_triangles(self.parts, self.path.places, self.path.tube)
        near = obstacle_triangles(one.problem.obstacles, self.path.places)
        self.tube, self.obstacles = (in_world(part, self.pose)[..., :2] for part in (tube, near))
        self.rest = self._body(self.path.places[-1], self.pose)

    def predicted(self, t: float) -> list[np.ndarray]:
        """The body at a time t [s] of the loop's clock, as the model says."""
        flat = self.path.places.reshape(len(self.path.times), -1)
        places = np.array([np.interp(t - self.begin, self.path.times, each) for each in flat.T])
        return self._body(places, self.pose)

    def driven(self, pose: np.ndarray) -> list[np.ndarray]:
        """The body at a true pose (3,)."""
        start = self.path.places[0]
        if self.pose.heading is None:
            return self._body(start - start[0] + pose[:2], self.pose)
        return self._body(start, Pose(pose[:2], float(pose[2])))

    def _body(self, places: np.ndarray, pose: Pose) -> list[np.ndarray]:
        outlines = footprints(self.parts, places.reshape(1, -1), 2)
        return [in_world(outline, pose)[:, :2] for outline in outlines]


class Moment(NamedTuple):
    """A time [s] of the loop's clock. number: of the manoeuvre under way. body: outlines (v, 2) [m]
    of its parts. middle (2,) [m] of them.
    """

    time: float
    number: int
    body: list[np.ndarray]
    middle: np.ndarray


class Stage:
    """All of an episode. source: the episode, or its file. truth: its true run, if there is one.
    reach: [m] half width of the picture around the robot. Raises InputError for a file whose proof
    fails, or an episode in space.
    """

    def __init__(self, source: Episode | str | Path, truth: Truth | None):
        driven = source if isinstance(source, Episode) else load_episode(source)
        if driven.model.n_p != 2:
            raise InputError(f"episode: expected one in the plane; got {driven.model.n_p}-D.")
        self.driven, self.truth = driven, truth
        self.shown = [Shown(driven, one) for one in driven.manoeuvres]
        self.name = driven.model.system or "episode"
        self.notes = [note for name, note in NOTES.items() if name in driven.statement]
        self.notes += [kind.strip()] if (kind := UNSHOWN.get(driven.model.claim.kind)) else []
        self.begin, self.end = self.shown[0].begin, self.shown[-1].end
        if truth is not None:  # shown from the first manoeuvre on
            times = as_float64("truth: times", truth.times, (None,))
            as_float64("truth: poses", truth.poses, (len(times), 3))
            if (np.diff(times) < 0).any() or not (times >= self.begin).any():
                told = f"some from {self.begin} s on, when the first manoeuvre begins"
                raise InputError(f"truth: expected sorted times, {told}; got {shown(times)}.")
            self.begin, self.end = max(self.begin, float(times[0])), float(times[-1])
        self.reach = max([REACH, *(np.ptp(one.tube, axis=(0, 1)).max() for one in self.shown)])

    def times(self, rate: float) -> np.ndarray:
        """[s] of so many moments a second, and the last."""
        return np.append(np.arange(self.begin, self.end - SAME, 1 / rate), self.end)

    def at(self, t: float) -> Moment:
        """The robot at a time [s]: its true place, or without a true run the predicted one."""
        number = int(sum(one.begin <= t + SAME for one in self.shown)) - 1
        one = self.shown[number]
        if self.truth is None:
            body = one.predicted(t)
        else:
            columns = np.asarray(self.truth.poses).T
            body = one.driven(np.array([np.interp(t, self.truth.times, each) for each in columns]))
        return Moment(t, number, body, np.mean([part.mean(axis=0) for part in body], axis=0))


def rings_of(region) -> list[list[np.ndarray]]:
    """Of each polygon of a Shapely region its outline (v, 2), then those of its holes."""
    parts = [one for one in getattr(region, "geoms", [region]) if not one.is_empty]
    return [[np.asarray(x.coords) for x in (one.exterior, *one.interiors)] for one in parts]
