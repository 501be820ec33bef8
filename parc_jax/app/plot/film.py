"""A plain film of one plan, for any robot: its true run where there is one, else the model's
prediction. In the plane from above, in space from three sides.
"""

from pathlib import Path

import numpy as np

from parc_jax.app.plot import shapes, style
from parc_jax.app.plot.film_file import counted, require_kind, require_sample, write_film
from parc_jax.app.plot.predict import predicted
from parc_jax.app.plot.views import View, views_of
from parc_jax.common.errors import InputError
from parc_jax.learning.labels import name_of, unit_of
from parc_jax.problem.body import numbered

RATE = 25.0  # [frames/s]
MOST = 250  # frames: a longer manoeuvre is shown faster than it is
REST = 15  # frames at the end, so that one sees where it stops
DPI = 100
INCHES = {2: (7.2, 5.0), 3: (11.6, 4.0)}  # by dimension of the workspace
TUBE, GOAL, OBSTACLE = "#D6E8F5", "#CBE8DF", "#6E6E6E"
SEE_THROUGH = 0.6  # obstacles in space, which hide what is behind them


def film(
    answer,
    out,
    sample: int = 0,
    run: np.ndarray | None = None,
    *,
    quiet: bool = True,
) -> Path:
    """Film one safe sample of an answer: .mp4, .gif, or a folder of .png files.

    run: (n_record + 1, n_c) [m] its recorded true run, all reference points in the workspace; None
    films the prediction. The body moves and turns with its points. Blue: the tube of every point
    that was proved, and the path predicted. quiet: no progress bar. Raises InputError.
    """
    out, model = Path(out), answer.model
    require_kind(out)
    require_sample(answer, sample)
    plan = answer.samples[sample]
    path, _, error = (part[0] for part in predicted(model, plan[None]))
    driven = path if run is None else np.asarray(run, float)
    if driven.shape[1:] != path.shape[1:]:
        raise InputError(
            f"film: expected a run with {path.shape[1]} columns, the coordinates of all reference "
            f"points; got {driven.shape[1]}."
        )
    seconds = np.linspace(0.0, model.time.t_f, len(driven))
    shown = np.linspace(0.0, model.time.t_f, min(MOST, round(model.time.t_f * RATE) + 1))
    at = np.stack([np.interp(shown, seconds, column) for column in driven.T], axis=1)
    caption = _caption(answer, sample, run is not None)
    way = "way so far" if run is None else "true run"
    stage = _Stage(answer, path, error, driven, caption, way)
    frames = [stage.frame(t, p) for t, p in counted(zip(shown, at, strict=True), len(at), quiet)]
    return write_film(out, [*frames, *[frames[-1]] * REST], RATE)


def _caption(answer, sample: int, true: bool) -> str:
    """System, sample, parameters by name, and whether one sees a run or a prediction."""
    model = answer.model
    k = answer.samples[sample][model.n_p :]
    words = [
        f"{name_of(label)} {value:.4g} {unit_of(label)}".rstrip()
        for label, value in zip(model.labels.k, k, strict=True)
    ]
    what = "true run" if true else "prediction of the model"
    return f"{model.system or 'plan'}: {what}, sample {sample}\n{', '.join(words)}"


class _Stage:
    """The scene on a canvas, drawn once; every frame adds what moves."""

    def __init__(self, answer, path, error, driven, caption: str, way: str):
        from matplotlib import rc_context
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        model, views = answer.model, views_of(answer.model.n_p)
        self.time = model.time
        self.seconds = np.linspace(0.0, self.time.t_f, len(driven))
        with rc_context(style.RC):
            figure = Figure(INCHES[model.n_p], dpi=DPI, layout="constrained")
            self.canvas = FigureCanvasAgg(figure)
            sides = [_Side(answer, view, path, error, driven) for view in views]
            ratios = [(side.hi - side.lo)[0] / (side.hi - side.lo)[1] for side in sides]
            axes = figure.subplots(1, len(views), width_ratios=ratios, squeeze=False)[0]
            figure.suptitle(caption, x=0.01, ha="left", fontsize=9.5)
            self.clock = figure.text(0.99, 0.99, "", ha="right", va="top", fontsize=11)
            self.clock.set_animated(True)
            style.legend(figure, _handles(model.points, way), 4)
            for side, ax in zip(sides, axes, strict=True):
                side.draw(ax)
            self.sides = sides
            self.canvas.draw()
            self.still = self.canvas.copy_from_bbox(figure.bbox)

    def frame(self, t: float, pose: np.ndarray) -> np.ndarray:
        """Image (height, width, 3) uint8 of time t [s], with the points of the robot at a pose
        (n_c,) [m].
        """
        interval = min(int(t / self.time.dt), self.time.n_steps - 1)
        past = int((self.seconds <= t).sum())
        self.clock.set_text(f"{t:.2f} s")
        self.canvas.restore_region(self.still)
        for side in self.sides:
            side.move(interval, past, pose)
        self.canvas.figure.draw_artist(self.clock)
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()


class _Side:
    """One view of the scene. path (T + 1, n_c), error (T, n_c), driven (t, n_c) [m]."""

    def __init__(self, answer, view: View, path, error, driven):
        model, problem = answer.model, answer.problem
        self.view, self.n_p, self.labels = view, model.n_p, model.labels.p
        self.parts = numbered(problem.body, model.points)
        self.spans = problem.all_spans
        self.path = self._of_points(path)
        self.tubes = shapes.tubes(self.path, self._of_points(error))
        self.driven = self._of_points(driven)[0]
        found = shapes.goals(problem.goal, model.n_p, model.n_points, [view.axes])
        self.goals = [outline for _, (outline,) in found]
        self.obstacles = [shapes.shadow(o, view.axes) for o in problem.obstacles]
        around = shapes.footprints(self.parts, driven, model.n_p, view.axes)
        self.lo, self.hi = shapes.span(self.path, *around, *self.goals, *self.obstacles)

    def _of_points(self, columns: np.ndarray) -> np.ndarray:
        """What is seen (m, t, 2) of columns (t, n_c)."""
        return self.view.of_points(columns, self.n_p).swapaxes(0, 1)

    def draw(self, ax) -> None:
        """What stands still, and what moves, which no draw of the whole figure shows."""
        from matplotlib.patches import Polygon

        self.ax = ax
        ax.set_aspect("equal")
        style.limits(ax, self.lo, self.hi)
        ax.set_xlabel(self.labels[self.view.axes[0]])
        ax.set_ylabel(self.labels[self.view.axes[1]])
        if self.n_p == 3:
            ax.set_title(self.view.name)
        for goal in self.goals:
            ax.fill(*goal.T, facecolor=GOAL, edgecolor=style.GREEN, zorder=0.6)
        style.areas(ax, self.tubes.reshape(-1, 6, 2), facecolors=TUBE, zorder=0.7)
        ax.plot(*self.path[0].T, color=style.BLUE, linewidth=0.9, zorder=2)
        ax.plot(*self.path[0, 0], marker="o", color=style.ORANGE, zorder=3)
        ink = None if self.n_p == 2 else SEE_THROUGH
        self.blocks = [
            Polygon(o, facecolor=OBSTACLE, alpha=ink, zorder=2.5) for o in self.obstacles
        ]
        looks = {"facecolor": style.SKY, "edgecolor": style.BLUE, "alpha": 0.5}
        self.body = [Polygon(np.zeros((1, 2)), **looks) for _ in self.parts]
        (self.trail,) = ax.plot([], [], color=style.BLACK, linewidth=1.6, zorder=4)
        for part in (*self.blocks, *self.body):
            ax.add_patch(part)
        self.moving = [*self.blocks, self.trail, *self.body]
        for part in self.moving:
            part.set_animated(True)

    def move(self, interval: int, past: int, pose: np.ndarray) -> None:
        """Draw what moves: in a model interval, with so many records past, at a pose (n_c,)."""
        for block, span in zip(self.blocks, self.spans, strict=True):
            block.set_visible(span is None or span[0] <= interval <= span[1])
        here = self._of_points(pose[None])[0]
        self.trail.set_data(*np.concatenate([self.driven[:past], here]).T)
        outlines = shapes.footprints(self.parts, pose[None], self.n_p, self.view.axes)
        for part, outline in zip(self.body, outlines, strict=True):
            part.set_xy(outline)
        for part in self.moving:
            self.ax.draw_artist(part)


def _handles(points: tuple[str, ...], way: str) -> list:
    of_points = "" if len(points) == 1 else " of every reference point"
    of_first = shapes.name_first(points)
    return [
        style.patch("obstacle", facecolor=OBSTACLE),
        style.patch("goal", facecolor=GOAL, edgecolor=style.GREEN),
        style.patch("body", facecolor=style.SKY, edgecolor=style.BLUE, alpha=0.5),
        style.patch(f"tube{of_points}", facecolor=TUBE),
        style.mark(f"predicted path{of_first}", color=style.BLUE, linewidth=0.9),
        style.mark(way + of_first, color=style.BLACK),
    ]
