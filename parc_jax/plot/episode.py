"""A film of an episode: one manoeuvre after another, each with all that the body may reach and the
stop that it ends in. In the plane, from above; the picture goes with the robot.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from parc_jax.answer.path import NominalPath, nominal_path
from parc_jax.errors import InputError
from parc_jax.io.episode_file import Driven, Manoeuvre, load_episode
from parc_jax.plot import style
from parc_jax.plot.film import OBSTACLE, TUBE
from parc_jax.plot.film_file import counted, require_kind, write_film
from parc_jax.plot.shapes import footprints
from parc_jax.plot.triangles import in_world, obstacle_triangles, tube_triangles
from parc_jax.problem.body import numbered
from parc_jax.robust.pose import Pose

RATE = 12.5  # [frames/s]
REST = 12  # frames at the end, so that one sees where it stops
REACH = 1.6  # [m] half width of what is shown around the robot, and more where a manoeuvre needs it
INCHES, DPI = (4.6, 5.0), 100
FREE, STANDS = "#F3F0DC", "#D9D9D9"


class Truth(NamedTuple):
    """What is known of an episode beyond its file. times (n,) [s] of the loop's clock and poses
    (n, 3) x, y [m], heading [rad]: where the robot truly was. standing: outlines (v, 2) [m] of what
    truly stands there. seen: (time [s], Shapely region) of places known to be free from then on.
    """

    times: np.ndarray
    poses: np.ndarray
    standing: Sequence[np.ndarray] = ()
    seen: Sequence[tuple[float, Any]] = ()


def film_episode(
    what: Driven | str | Path, out, truth: Truth | None = None, *, quiet: bool = True
) -> Path:
    """Film an episode: .mp4, .gif, or a folder of .png files.

    what: a file of `save_episode`, which is checked anew first, or one that was loaded. truth: the
    run as it was; without it the film shows what was predicted of every manoeuvre until the next
    one began. quiet: no progress bar. Raises InputError, also for an episode in space.
    """
    out = Path(out)
    require_kind(out)
    driven = what if isinstance(what, Driven) else load_episode(what)
    if driven.model.n_p != 2:
        raise InputError(
            f"film: expected an episode in the plane; got one in {driven.model.n_p}-D."
        )
    stage = _Stage(driven, truth)
    times = np.arange(stage.begin, stage.end + 0.5 / RATE, 1 / RATE)
    frames = [stage.frame(t) for t in counted(times, len(times), quiet)]
    return write_film(out, [*frames, *[frames[-1]] * REST], RATE)


class _Shown:
    """One manoeuvre in the world: triangles (t, 3, 2) [m] of the tube that its body sweeps and of
    the obstacles that it was proved against; outlines (v, 2) [m] of the body at its rest.
    """

    def __init__(self, driven: Driven, one: Manoeuvre):
        self.begin, self.pose = float(one.begin), one.pose
        self.path: NominalPath = nominal_path(driven.model, one.p0, one.k)
        self.parts = numbered(one.problem.body, driven.model.points)
        tube = tube_triangles(self.parts, self.path.places, self.path.tube)
        self.tube = in_world(tube, self.pose)[..., :2]
        near = obstacle_triangles(one.problem.obstacles, self.path.places)
        self.obstacles = in_world(near, self.pose)[..., :2]
        self.rest = self._body(self.path.places[-1], self.pose)

    def predicted(self, t: float) -> list[np.ndarray]:
        """The body at a time t [s] of the loop's clock, as the model says."""
        flat = self.path.places.reshape(len(self.path.times), -1)
        since = t - self.begin
        places = np.array([np.interp(since, self.path.times, column) for column in flat.T])
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


class _Stage:
    """A canvas on which every frame is drawn anew: all of it moves."""

    def __init__(self, driven: Driven, truth: Truth | None):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.shown = [_Shown(driven, one) for one in driven.manoeuvres]
        self.truth, self.name = truth, driven.model.system or "episode"
        self.begin = self.shown[0].begin
        self.end = self.shown[-1].begin + float(self.shown[-1].path.times[-1])
        if truth is not None:
            self.begin, self.end = float(truth.times[0]), float(truth.times[-1])
        self.reach = max([REACH, *(np.ptp(one.tube, axis=(0, 1)).max() for one in self.shown)])
        self.way: list[np.ndarray] = []
        self.figure = Figure(INCHES, dpi=DPI, layout="constrained")
        self.canvas = FigureCanvasAgg(self.figure)

    def frame(self, t: float) -> np.ndarray:
        """Image (height, width, 3) uint8 of a time t [s]."""
        from matplotlib import rc_context

        with rc_context(style.RC):
            self.figure.clear()
            self._draw(self.figure.subplots(), t)
            self.canvas.draw()
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()

    def _draw(self, ax, t: float) -> None:
        from matplotlib.collections import PolyCollection

        def fill(polygons, colour, **kind) -> None:
            ax.add_collection(PolyCollection(list(polygons), facecolor=colour, **kind))

        number = sum(one.begin <= t + 1e-9 for one in self.shown) - 1
        one = self.shown[max(number, 0)]
        body = self._body(one, t)
        middle = np.mean([outline.mean(axis=0) for outline in body], axis=0)
        self.way.append(middle)
        if self.truth is not None:
            fill(self.truth.standing, STANDS)
            self._draw_free(ax, t)
        fill(one.tube, TUBE, edgecolor=TUBE, linewidth=0.3)
        fill(one.obstacles, OBSTACLE, edgecolor=OBSTACLE, linewidth=0.6)
        fill(one.rest, "none", edgecolor=style.BLUE, linewidth=0.8)
        ax.plot(*np.array(self.way).T, color=style.BLUE, linewidth=0.9)
        fill(body, style.BLUE)
        ax.set_aspect("equal")
        for limits, at in ((ax.set_xlim, middle[0]), (ax.set_ylim, middle[1])):
            limits(at - self.reach, at + self.reach)
        ax.set_axis_off()
        ax.set_title(f"{self.name}, {t - self.begin:.1f} s: manoeuvre {number + 1}")
        style.legend(self.figure, _handles(self.truth), 3)

    def _body(self, one: _Shown, t: float) -> list[np.ndarray]:
        if self.truth is None:
            return one.predicted(t)
        columns = self.truth.poses.T
        return one.driven(np.array([np.interp(t, self.truth.times, each) for each in columns]))

    def _draw_free(self, ax, t: float) -> None:
        """The last region that was seen by then."""
        from matplotlib.patches import PathPatch
        from matplotlib.path import Path as Outline

        known = [region for time, region in self.truth.seen if time <= t + 1e-9]
        for part in _parts(known[-1]) if known else ():
            rings = [np.asarray(ring.coords) for ring in (part.exterior, *part.interiors)]
            outline = Outline.make_compound_path(*[Outline(ring, closed=True) for ring in rings])
            ax.add_patch(PathPatch(outline, facecolor=FREE, edgecolor="none"))


def _parts(region) -> list:
    """Polygons of a Shapely region."""
    return [one for one in getattr(region, "geoms", [region]) if not one.is_empty]


def _handles(truth: Truth | None) -> list:
    from matplotlib.patches import Patch

    found = [
        Patch(color=style.BLUE, label="robot"),
        Patch(color=TUBE, label="may reach, proved"),
        Patch(facecolor="none", edgecolor=style.BLUE, label="stop in hand"),
        Patch(color=OBSTACLE, label="obstacles of the proof"),
    ]
    if truth is not None:
        found += [Patch(color=FREE, label="seen free"), Patch(color=STANDS, label="stands there")]
    return found
