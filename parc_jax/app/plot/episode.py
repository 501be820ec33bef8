"""A film of an episode: one manoeuvre after another, each with all that the body may reach and the
stop that it ends in. In the plane, from above; the picture goes with the robot.
"""

from pathlib import Path

import numpy as np

from parc_jax.app.plot import style
from parc_jax.app.plot.film import OBSTACLE, TUBE
from parc_jax.app.plot.film_file import counted, require_kind, write_film
from parc_jax.app.plot.manoeuvres import Stage, Truth, polygons
from parc_jax.drive.loop.episode_file import Episode

RATE = 10.0  # [frames/s]
REST = 10  # frames at the end, so that one sees where it stops
COLOURS = 32  # of a .gif: seven, and what is between them on edges
INCHES, DPI = (4.6, 5.0), 100
FREE, STANDS = "#F3F0DC", "#D9D9D9"


def film_episode(
    what: Episode | str | Path, out, truth: Truth | None = None, *, quiet: bool = True
) -> Path:
    """Film an episode: .mp4, .gif, or a folder of .png files.

    what: a file of `save_episode`, which is checked anew first, or one that was loaded. truth: the
    run as it was; without it the film shows what was predicted of every manoeuvre until the next
    one began. quiet: no progress bar. Raises InputError, also for an episode in space.
    """
    out = Path(out)
    require_kind(out)
    canvas = _Canvas(Stage(what, truth))
    times = canvas.stage.times(RATE)
    frames = [canvas.frame(t) for t in counted(times, len(times), quiet)]
    return write_film(out, [*frames, *[frames[-1]] * REST], RATE, COLOURS)


class _Canvas:
    """On which every frame is drawn anew: all of it moves."""

    def __init__(self, stage: Stage):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.stage = stage
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
        stage, now = self.stage, self.stage.at(t)
        one = stage.shown[now.number]
        self.way.append(now.middle)
        if stage.truth is not None:
            style.areas(ax, list(stage.truth.standing), facecolor=STANDS)
            self._draw_free(ax, t)
        style.areas(ax, one.tube, facecolor=TUBE, edgecolor=TUBE, linewidth=0.3)
        looks = {"facecolor": OBSTACLE, "edgecolor": OBSTACLE, "linewidth": 0.6}
        style.areas(ax, one.obstacles, **looks)
        style.areas(ax, one.rest, facecolor="none", edgecolor=style.BLUE, linewidth=0.8)
        ax.plot(*np.array(self.way).T, color=style.BLUE, linewidth=0.9)
        style.areas(ax, now.body, facecolor=style.BLUE)
        ax.set_aspect("equal")
        style.limits(ax, now.middle - stage.reach, now.middle + stage.reach)
        ax.set_axis_off()
        ax.set_title(f"{stage.name}, {t - stage.begin:.1f} s: manoeuvre {now.number}")
        style.legend(self.figure, _handles(stage.truth), 3)

    def _draw_free(self, ax, t: float) -> None:
        """The last region that was seen by then."""
        from matplotlib.patches import PathPatch
        from matplotlib.path import Path as Outline

        known = [region for time, region in self.stage.truth.seen if time <= t + 1e-9]
        for part in polygons(known[-1]) if known else ():
            rings = [np.asarray(ring.coords) for ring in (part.exterior, *part.interiors)]
            outline = Outline.make_compound_path(*[Outline(ring, closed=True) for ring in rings])
            ax.add_patch(PathPatch(outline, facecolor=FREE, edgecolor="none"))


def _handles(truth: Truth | None) -> list:
    found = [
        style.patch("robot", color=style.BLUE),
        style.patch("may reach, proved", color=TUBE),
        style.patch("stop in hand", facecolor="none", edgecolor=style.BLUE),
        style.patch("obstacles of the proof", color=OBSTACLE),
    ]
    if truth is not None:
        found += [style.patch("seen free", color=FREE), style.patch("stands there", color=STANDS)]
    return found
