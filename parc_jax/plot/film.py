"""A plain film of one plan from above, for any robot: its true run where there is one, else the
model's prediction.
"""

from pathlib import Path

import numpy as np

from parc_jax.errors import InputError
from parc_jax.labels import name_of, unit_of
from parc_jax.plot import shapes, style
from parc_jax.plot.film_file import counted, require_kind, require_sample, write_film
from parc_jax.plot.predict import predicted

RATE = 25.0  # [frames/s]
MOST = 250  # frames: a longer manoeuvre is shown faster than it is
REST = 15  # frames at the end, so that one sees where it stops
INCHES, DPI = (7.2, 4.6), 100


def film(
    answer,
    out,
    sample: int = 0,
    run: np.ndarray | None = None,
    *,
    quiet: bool = True,
) -> Path:
    """Film one safe sample of an answer from above: .mp4, .gif, or a folder of .png files.

    run: (n_record + 1, 2) [m] its recorded true run, in the workspace; None films the prediction.
    Blue: the tube that was proved, and the path predicted. quiet: no progress bar. Raises
    InputError.
    """
    out, model = Path(out), answer.model
    require_kind(out)
    if model.n_p != 2:
        raise InputError(f"film: expected a planar workspace; this one has {model.n_p} dimensions.")
    require_sample(answer, sample)
    plan = answer.samples[sample]
    path, _, error = (part[0] for part in predicted(model, plan[None]))
    driven = path if run is None else np.asarray(run, float)
    seconds = np.linspace(0.0, model.time.t_f, len(driven))
    shown = np.linspace(0.0, model.time.t_f, min(MOST, round(model.time.t_f * RATE) + 1))
    at = np.stack([np.interp(shown, seconds, driven[:, axis]) for axis in range(2)], axis=1)
    stage = _Stage(answer, path, error, driven, _caption(answer, sample, run is not None))
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

    def __init__(self, answer, path, error, driven, caption: str):
        from matplotlib import rc_context
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.collections import PolyCollection
        from matplotlib.figure import Figure
        from matplotlib.patches import Polygon

        self.answer, self.driven = answer, driven
        self.body = shapes.body_outline(answer.problem.body)
        self.seconds = np.linspace(0.0, answer.model.time.t_f, len(driven))
        with rc_context(style.RC):
            figure = Figure(INCHES, dpi=DPI, layout="constrained")
            self.canvas = FigureCanvasAgg(figure)
            self.ax = ax = figure.subplots()
            ax.set_title(caption)
            ax.set_aspect("equal")
            ax.set_xlabel(answer.model.labels.p[0])
            ax.set_ylabel(answer.model.labels.p[1])
            goal = shapes.shadow(answer.problem.goal)
            ax.fill(*goal.T, facecolor="#CBE8DF", edgecolor=style.GREEN, zorder=0.6)
            swept = shapes.tubes(path, error)
            ax.add_collection(PolyCollection(swept, facecolors="#D6E8F5", zorder=0.7))
            ax.plot(*path.T, color=style.BLUE, linewidth=0.9, zorder=2)
            ax.plot(*path[0], marker="o", color=style.ORANGE, zorder=3)
            obstacles = [shapes.shadow(o) for o in answer.problem.obstacles]
            lo, hi = shapes.span(path, driven, goal, *obstacles, self.body + path[0])
            ax.set_xlim(lo[0], hi[0])
            ax.set_ylim(lo[1], hi[1])
            self.blocks = [Polygon(o, facecolor="#6E6E6E", zorder=2.5) for o in obstacles]
            self.robot = Polygon(self.body, facecolor=style.SKY, edgecolor=style.BLUE, alpha=0.5)
            (self.trail,) = ax.plot([], [], color=style.BLACK, linewidth=1.6, zorder=4)
            self.clock = ax.text(0.99, 0.98, "", transform=ax.transAxes, ha="right", va="top")
            self.moving = [*self.blocks, self.trail, self.robot, self.clock]
            for part in (*self.blocks, self.robot):
                ax.add_patch(part)
            for part in self.moving:
                part.set_animated(True)
            self.canvas.draw()
            self.still = self.canvas.copy_from_bbox(figure.bbox)

    def frame(self, t: float, at: np.ndarray) -> np.ndarray:
        """Image (height, width, 3) uint8 of time t [s], with the robot at a position (2,) [m]."""
        interval = min(int(t / self.answer.model.time.dt), self.answer.model.time.n_steps - 1)
        for block, span in zip(self.blocks, self.answer.problem.spans, strict=True):
            block.set_visible(span is None or span[0] <= interval <= span[1])
        past = self.driven[self.seconds <= t]
        self.trail.set_data(*np.concatenate([past, at[None]]).T)
        self.robot.set_xy(self.body + at)
        self.clock.set_text(f"{t:.2f} s")
        self.canvas.restore_region(self.still)
        for part in self.moving:
            self.ax.draw_artist(part)
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()
